import { frame } from "./studio.js";

frame("recipe");
