//! The token that every URL begins with.

use petcomp::{Error, Result};
use std::fmt;

/// 128 random bits, as hexadecimal digits.
pub(super) struct Token(String);

impl Token {
    pub(super) fn random() -> Result<Self> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(|e| Error::value("token", e))?;
        Ok(Self(bytes.iter().map(|b| format!("{b:02x}")).collect()))
    }

    /// Whether a text is the token, in constant time.
    pub(super) fn is(&self, said: &str) -> bool {
        let pairs = self.0.bytes().zip(said.bytes());
        let difference = pairs.fold(0, |all, (a, b)| all | (a ^ b));
        said.len() == self.0.len() && difference == 0
    }
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_itself_and_nothing_else() {
        let [a, b] = [(); 2].map(|()| Token::random().unwrap());
        assert!(a.is(&a.0) && !a.is(&b.0) && !a.is("") && !a.is(&a.0[..31]) && a.0.len() == 32);
    }
}
