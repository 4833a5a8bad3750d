//! Separate falls of objects that cannot touch each other.
//!
//! Cards in separate columns fall in separate worlds; a card that has a column to itself needs
//! none. This is checked afterwards: if the spaces swept by two columns overlap, they fall again,
//! together.

use super::level;
use super::world::{Drop, Fall};
use crate::error::Result;
use crate::geom::Pose;
use crate::scene::{Scene, SettleOptions};

/// Objects that fall together, and how their fall ended.
struct FallenColumn {
    members: Vec<usize>,
    fall: Fall,
}

/// Lets everything fall; the poses are in the order of the objects that fall.
///
/// # Errors
/// As [`Drop::fall`].
pub(super) fn fall(drop: &Drop) -> Result<Fall> {
    let mut columns: Vec<FallenColumn> = level::columns(drop.scene, drop.options)
        .into_iter()
        .map(|members| FallenColumn::drop_members(drop, members))
        .collect::<Result<_>>()?;
    while let Some((i, j)) = first_colliding_pair(&columns) {
        let mut members = [&columns[i].members[..], &columns[j].members[..]].concat();
        members.sort_unstable();
        columns.swap_remove(j);
        columns[i] = FallenColumn::drop_members(drop, members)?;
    }
    Ok(merge_columns(columns))
}

impl FallenColumn {
    fn drop_members(drop: &Drop, members: Vec<usize>) -> Result<Self> {
        let closed_form = match members[..] {
            [i] => fall_alone(drop.scene, drop.options, i),
            _ => None,
        };
        let fall = closed_form.map_or_else(|| drop.fall(&members), Ok)?;
        Ok(Self { members, fall })
    }
}

/// The fall of a card that cannot touch anything; none if it may.
fn fall_alone(scene: &Scene, options: &SettleOptions, i: usize) -> Option<Fall> {
    let pose = level::rest_alone(scene, options, i)?;
    let radius = options.half_body(&scene.objects[i]).norm();
    let center = [pose.translation.x, pose.translation.y];
    Some(Fall {
        poses: vec![Some(pose)],
        rests: true,
        swept: center.map(|at| [at - radius, at + radius]),
        ..Fall::default()
    })
}

/// The first two columns, in order, whose swept spaces overlap; NaN overlaps everything.
fn first_colliding_pair(columns: &[FallenColumn]) -> Option<(usize, usize)> {
    let count = columns.len();
    let mut pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    pairs.find(|&(i, j)| !are_apart(&columns[i].fall, &columns[j].fall))
}

fn are_apart(a: &Fall, b: &Fall) -> bool {
    let mut axes = a.swept.iter().zip(&b.swept);
    axes.any(|(a, b)| a[1] < b[0] || b[1] < a[0])
}

fn merge_columns(columns: Vec<FallenColumn>) -> Fall {
    let mut all = Fall {
        rests: true,
        ..Fall::default()
    };
    let mut poses: Vec<(usize, Option<Pose>)> = Vec::new();
    for FallenColumn { members, mut fall } in columns {
        poses.extend(members.into_iter().zip(std::mem::take(&mut fall.poses)));
        all.absorb(fall);
    }
    poses.sort_by_key(|(i, _)| *i);
    all.poses = poses.into_iter().map(|(_, pose)| pose).collect();
    all.sort_samples();
    all
}

impl Fall {
    /// Merges another fall into this one, except its poses.
    fn absorb(&mut self, other: Self) {
        self.rests &= other.rests;
        self.seconds = self.seconds.max(other.seconds);
        self.energy_rise = self.energy_rise.max(other.energy_rise);
        self.samples.extend(other.samples);
    }

    /// By time, then by id.
    fn sort_samples(&mut self) {
        self.samples.sort_by(|a, b| {
            a.seconds
                .total_cmp(&b.seconds)
                .then(a.object.cmp(&b.object))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allowance::Allowance;
    use crate::scene::Placement;
    use crate::settle::attempt::start_heights;
    use crate::settle::tests::{dropped, falling};

    fn drop<'a>(
        scene: &'a Scene,
        options: &'a SettleOptions,
        heights: &'a [f64],
        allowance: &'a Allowance,
    ) -> Drop<'a> {
        Drop {
            scene,
            options,
            heights,
            sample_every: 0,
            halvings: 0,
            allowance,
        }
    }

    #[test]
    fn columns_apart_end_as_if_each_were_the_only_one() {
        let mut scene = falling(&[
            ([-0.6, 0.0], 0.05),
            ([-0.62, 0.0], 0.1),
            ([0.6, 0.1], 0.05),
            ([0.6, 0.12], 0.2),
        ]);
        scene.surface.size = [2.0, 1.0];
        let (options, heights) = (SettleOptions::default(), start_heights(&scene, 0));
        let allowance = Allowance::new(options.most_work);
        let drop = drop(&scene, &options, &heights, &allowance);
        let of = |members: &[usize]| drop.fall(members).unwrap().poses;
        assert_eq!(
            fall(&drop).unwrap().poses,
            [of(&[0, 1]), of(&[2, 3])].concat()
        );
    }

    #[test]
    fn columns_that_spread_into_each_other_fall_together() {
        // Two towers standing on edge, side by side, that topple.
        let mut scene = dropped(0, 8);
        for (i, object) in scene.objects.iter_mut().enumerate() {
            let side = if i % 2 == 0 { -0.12 } else { 0.12 };
            let rotation = crate::geom::UnitQuaternion::from_euler_angles(0.0, 1.4, 0.0);
            object.placement = Placement::Drop {
                above: [side, 0.0],
                height: 0.15 + 0.12 * i as f64,
                rotation,
            };
            (object.size, object.thickness) = ([0.2, 0.08], 0.01);
        }
        let (options, heights) = (SettleOptions::default(), start_heights(&scene, 0));
        assert_eq!(level::columns(&scene, &options).len(), 2);
        let allowance = Allowance::new(options.most_work);
        let drop = drop(&scene, &options, &heights, &allowance);
        assert_eq!(
            fall(&drop).unwrap().poses,
            drop.fall(&(0..8).collect::<Vec<_>>()).unwrap().poses
        );
    }
}
