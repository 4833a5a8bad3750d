import { frame } from "./studio.js";

frame("corners");
