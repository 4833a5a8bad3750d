//! The purpose of an asset in pictures.

use crate::error::Error;
use crate::names::{by_name, name_of};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The purpose of an asset in pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// To be found: it has a class and a label.
    #[default]
    Object,
    /// To be in the way: it falls, hides others and casts shadows, but has no class and no label.
    Distractor,
}

impl Role {
    /// All of them with their names.
    const ALL: [(&'static str, Self); 2] =
        [("object", Self::Object), ("distractor", Self::Distractor)];

    /// Whether it is to be found: the role that files need not state.
    pub fn is_object(&self) -> bool {
        *self == Self::Object
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name_of(&Self::ALL, self))
    }
}

impl FromStr for Role {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        by_name("role", &Self::ALL, name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_role_is_named_the_same_in_files_and_arguments() {
        for (name, role) in Role::ALL {
            assert_eq!(name.parse::<Role>().unwrap(), role);
            assert_eq!(serde_json::to_value(role).unwrap(), name);
            assert_eq!(role.to_string(), name);
        }
        let told = "cap".parse::<Role>().unwrap_err().to_string();
        assert_eq!(told, "role: \"cap\", expected one of object, distractor");
    }
}
