//! Label files: what a person says of a photo of a surface (`NAME.label.json`).
