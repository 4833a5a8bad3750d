import { frame } from "./studio.js";

frame("dataset");
