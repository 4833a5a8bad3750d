//! Selects the channels of a file from which pixels are read.

/// Channels of a film's measured transmittance: the screen seen through it and in its shadow.
pub(crate) const TRANSMITTANCE: [&str; 3] = ["TR", "TG", "TB"];
/// Channels of a film's view transmittance: the share of the line of sight that passes.
pub(crate) const VIEW_TRANSMITTANCE: [&str; 3] = ["VR", "VG", "VB"];

/// The kind of pixel that is read, which determines its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wanted {
    /// `R G B`, or `Y` for grey; `A` if present.
    Color,
    /// Like `Color`, with the transmittance `VR VG VB` or else `TR TG TB`, if present.
    Film,
    /// The only channel, or the three equal ones of a grey picture, or `A`.
    Coverage,
    /// The only channel, or `Z`.
    Depth,
}

/// How channels were matched, the best match first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ChannelMatch {
    /// By their default names.
    Named,
    /// As channels of a layer: `diffuse.R`.
    Layer,
    /// As the only candidate.
    Alone,
}

/// How well channels match, and their indices.
pub(crate) type Choice = (ChannelMatch, Vec<usize>);

/// Layers preferred over others: common names of the finished picture.
const FINISHED_LAYERS: [&str; 5] = ["combined", "rgba", "rgb", "beauty", "color"];

/// Channels that are not a grey picture.
const INVISIBLE_CHANNELS: [&str; 3] = ["A", "Z", "ZBack"];

impl Wanted {
    /// Indices of the wanted channels among `names`: red, green, blue and perhaps alpha, or one.
    pub(crate) fn pick(self, names: &[String]) -> Result<Vec<usize>, String> {
        self.choose(names).map(|(_, picked)| picked)
    }

    /// Like [`pick`](Self::pick), and how well they match.
    pub(crate) fn choose(self, names: &[String]) -> Result<Choice, String> {
        let found = match self {
            Self::Film => choose_film(names),
            Self::Color => choose_color(names),
            _ if names.len() == 1 => Some((self.match_alone(&names[0]), vec![0])),
            Self::Coverage => choose_coverage(names),
            Self::Depth => choose_depth(names),
        };
        found.ok_or_else(|| self.missing_among(names))
    }

    /// How well the only channel of a picture matches a matte or a depth.
    fn match_alone(self, name: &str) -> ChannelMatch {
        let expected: &[&str] = match self {
            Self::Depth => &["Z"],
            _ => &["Y", "A", "mask"],
        };
        match expected.contains(&base_name(name)) {
            true => ChannelMatch::Named,
            false => ChannelMatch::Alone,
        }
    }

    /// Whether the pixels are colours.
    pub(crate) fn is_color(self) -> bool {
        matches!(self, Self::Color | Self::Film)
    }

    /// The names with an alpha appended, if they are colours without alpha.
    pub(crate) fn with_alpha(self, names: &[String]) -> Option<Vec<String>> {
        let picks = |names: &[String]| self.pick(names).map_or(0, |picked| picked.len());
        let layer = names[0].rfind('.').map_or("", |dot| &names[0][..=dot]);
        let extended = [names, &[format!("{layer}A")]].concat();
        let is_without = self.is_color() && picks(names) == 3 && picks(&extended) == 4;
        is_without.then_some(extended)
    }

    /// Whether a channel is 1 instead of 0 where nothing is stored: all light passes there.
    pub(crate) fn is_one_where_empty(self, name: &str) -> bool {
        let is_transmittance = VIEW_TRANSMITTANCE.contains(&name) || TRANSMITTANCE.contains(&name);
        self == Self::Film && is_transmittance
    }

    /// The message if the wanted channels are missing.
    pub(crate) fn missing_among(self, names: &[String]) -> String {
        format!(
            "has the channels {}, expected {}",
            names.join(" "),
            self.expected()
        )
    }

    pub(crate) fn expected(self) -> &'static str {
        match self {
            Self::Color | Self::Film => "R G B or Y, with or without A",
            Self::Coverage => "one channel, three equal ones R G B, or one named A or Y",
            Self::Depth => "one channel, or one named Z",
        }
    }
}

/// Colour, with the transmittance instead of alpha if there is one.
fn choose_film(names: &[String]) -> Option<Choice> {
    let (fit, mut picked) = choose_color(names)?;
    if let Some(transmittance) = transmittance_of(names) {
        picked.truncate(3);
        picked.extend(transmittance);
    }
    Some((fit, picked))
}

fn transmittance_of(names: &[String]) -> Option<Vec<usize>> {
    all_of_layer(names, "", VIEW_TRANSMITTANCE).or_else(|| all_of_layer(names, "", TRANSMITTANCE))
}

/// A grey picture, or else alpha.
fn choose_coverage(names: &[String]) -> Option<Choice> {
    let picked = color_of_layer(names, "")
        .or_else(|| index_in_layer(names, "", "A").map(|alpha| vec![alpha]))?;
    Some((ChannelMatch::Named, picked))
}

/// `Z`, or the only `Z` in a layer.
fn choose_depth(names: &[String]) -> Option<Choice> {
    if let Some(depth) = index_in_layer(names, "", "Z") {
        return Some((ChannelMatch::Named, vec![depth]));
    }
    let depth = only_index(names, |name| base_name(name) == "Z")?;
    Some((ChannelMatch::Layer, vec![depth]))
}

/// Colour by its default names, or in a layer, or the only visible channel.
fn choose_color(names: &[String]) -> Option<Choice> {
    if let Some(picked) = color_of_layer(names, "") {
        return Some((ChannelMatch::Named, picked));
    }
    color_of_best_layer(names)
        .map(|picked| (ChannelMatch::Layer, picked))
        .or_else(|| Some((ChannelMatch::Alone, only_visible(names)?)))
}

/// The only visible channel three times, and the only alpha.
fn only_visible(names: &[String]) -> Option<Vec<usize>> {
    let seen = only_index(names, |_| true)
        .or_else(|| only_index(names, |name| !INVISIBLE_CHANNELS.contains(&base_name(name))))?;
    let alpha = only_index(names, |name| base_name(name) == "A").filter(|&a| a != seen);
    Some([seen; 3].into_iter().chain(alpha).collect())
}

/// Colour of the layer named as finished, or of the first layer that has colour.
fn color_of_best_layer(names: &[String]) -> Option<Vec<usize>> {
    let layers: Vec<(&str, Vec<usize>)> = names
        .iter()
        .filter_map(|name| Some(&name[..=name.rfind('.')?]))
        .filter_map(|layer| Some((layer, color_of_layer(names, layer)?)))
        .collect();
    let finished = layers.iter().find(|(layer, _)| is_finished(layer));
    let (_, color) = finished.or(layers.first())?;
    Some(color.clone())
}

/// Whether the name of a layer, with or without trailing dot, is that of a finished picture.
pub(crate) fn is_finished(layer: &str) -> bool {
    let name = base_name(layer.trim_end_matches('.')).to_lowercase();
    FINISHED_LAYERS.contains(&name.as_str())
}

/// `R G B` or `Y` of a layer, with its `A`.
fn color_of_layer(names: &[String], layer: &str) -> Option<Vec<usize>> {
    let color = all_of_layer(names, layer, ["R", "G", "B"])
        .or_else(|| all_of_layer(names, layer, ["r", "g", "b"]))
        .or_else(|| index_in_layer(names, layer, "Y").map(|y| vec![y; 3]))?;
    let alpha = index_in_layer(names, layer, "A").or_else(|| index_in_layer(names, layer, "a"));
    Some(color.into_iter().chain(alpha).collect())
}

fn all_of_layer(names: &[String], layer: &str, channels: [&str; 3]) -> Option<Vec<usize>> {
    channels
        .into_iter()
        .map(|channel| index_in_layer(names, layer, channel))
        .collect()
}

fn index_in_layer(names: &[String], layer: &str, channel: &str) -> Option<usize> {
    names
        .iter()
        .position(|name| name.strip_prefix(layer) == Some(channel))
}

/// A channel's name without its layer.
fn base_name(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// The index of the only channel of a kind.
fn only_index(names: &[String], is: impl Fn(&str) -> bool) -> Option<usize> {
    let mut found = names.iter().enumerate().filter(|(_, name)| is(name));
    let (i, _) = found.next()?;
    found.next().is_none().then_some(i)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(String::from).collect()
    }

    #[test]
    fn colour_is_found_by_name_by_layer_and_alone() {
        for (channels, fit, picked) in [
            ("A B G R", ChannelMatch::Named, "R G B A"),
            ("b g r", ChannelMatch::Named, "r g b"),
            (
                "A Y diffuse.B diffuse.G diffuse.R",
                ChannelMatch::Named,
                "Y Y Y A",
            ),
            (
                "d.B d.G d.R s.B s.G s.R",
                ChannelMatch::Layer,
                "d.R d.G d.B",
            ),
            (
                "V.Alb.B V.Alb.G V.Alb.R V.Combined.A V.Combined.B V.Combined.G V.Combined.R V.Depth.Z",
                ChannelMatch::Layer,
                "V.Combined.R V.Combined.G V.Combined.B V.Combined.A",
            ),
            (
                "left.Y left.A",
                ChannelMatch::Layer,
                "left.Y left.Y left.Y left.A",
            ),
            ("mask", ChannelMatch::Alone, "mask mask mask"),
            ("A", ChannelMatch::Alone, "A A A"),
            ("R Z", ChannelMatch::Alone, "R R R"),
            ("A R", ChannelMatch::Alone, "R R R A"),
        ] {
            let names = names(channels);
            let (found, indices) = Wanted::Color.choose(&names).unwrap();
            let found = (
                found,
                indices
                    .into_iter()
                    .map(|i| names[i].as_str())
                    .collect::<Vec<_>>()
                    .join(" "),
            );
            assert_eq!(found, (fit, picked.to_string()), "{channels}");
        }
        for none in ["u v", "A Z", "d.R d.G s.B", "N.x N.y N.z"] {
            assert!(Wanted::Color.pick(&names(none)).is_err(), "{none}");
        }
    }

    #[test]
    fn depth_is_found_in_a_layer() {
        assert_eq!(Wanted::Depth.pick(&names("V.C.R V.Depth.Z")).unwrap(), [1]);
        assert!(
            Wanted::Depth
                .pick(&names("V.C.R V.Depth.Z V.Mist.Z"))
                .is_err()
        );
    }

    #[test]
    fn a_single_channel_serves_best_under_its_own_name() {
        let matched = |wanted: Wanted, name: &str| wanted.choose(&names(name)).unwrap().0;
        for (name, matte, depth) in [
            ("Y", ChannelMatch::Named, ChannelMatch::Alone),
            ("mask", ChannelMatch::Named, ChannelMatch::Alone),
            ("V.Z", ChannelMatch::Alone, ChannelMatch::Named),
        ] {
            let found = [Wanted::Coverage, Wanted::Depth].map(|wanted| matched(wanted, name));
            assert_eq!(found, [matte, depth], "{name}");
        }
    }
}
