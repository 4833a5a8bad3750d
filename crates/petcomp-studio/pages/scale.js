import { frame } from "./studio.js";

frame("scale");
