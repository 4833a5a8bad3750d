//! Settle: dropped objects come to rest.
