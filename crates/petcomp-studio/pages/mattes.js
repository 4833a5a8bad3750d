import { frame } from "./studio.js";

frame("mattes");
