//! Input and output: the only place that opens pictures.
