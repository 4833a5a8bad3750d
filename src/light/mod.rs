//! Light: area lights, ambient, and the exposure that makes rendered light match a plate.
