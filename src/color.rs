//! Colour: transfer curves, primaries, hue and saturation, exactly.
