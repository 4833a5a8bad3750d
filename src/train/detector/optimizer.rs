//! Nesterov's gradient descent in two groups: what decays and what does not.

use super::network::Network;
use super::schedule::Schedule;
use burn::module::{Module, ModuleVisitor, Param, ParamId};
use burn::optim::adaptor::OptimizerAdaptor;
use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{GradientsParams, Optimizer as _, Sgd, SgdConfig};
use burn::tensor::Tensor;
use burn::tensor::backend::{AutodiffBackend, Backend};

type Group<B> = OptimizerAdaptor<Sgd<<B as AutodiffBackend>::InnerBackend>, Network<B>, B>;
/// What a group remembers.
pub(super) type GroupRecord<B> = <Group<B> as burn::optim::Optimizer<Network<B>, B>>::Record;

/// Descends along gradients, remembering their direction.
pub(super) struct Optimizer<B: AutodiffBackend> {
    schedule: Schedule,
    /// Weights of convolutions decay; biases and normalisations do not.
    groups: [Group<B>; 2],
    members: [Vec<ParamId>; 2],
}

impl<B: AutodiffBackend> Optimizer<B> {
    pub(super) fn new(schedule: Schedule, network: &Network<B>) -> Self {
        let mut members = Members::default();
        network.visit(&mut members);
        let groups = [0, 1].map(|i| group(&schedule, i, schedule.momentum));
        Self { schedule, groups, members: [members.weights, members.others] }
    }

    /// An update; `gradients` are those of `network`.
    pub(super) fn step(
        &mut self,
        [rate, momentum]: [f64; 2],
        mut network: Network<B>,
        mut gradients: B::Gradients,
    ) -> Network<B> {
        for i in 0..self.groups.len() {
            let own = GradientsParams::from_params(&mut gradients, &network, &self.members[i]);
            // burn fixes the momentum when an optimizer is made, so one is made anew around the same memory.
            let mut next = group(&self.schedule, i, momentum).load_record(self.groups[i].to_record());
            network = next.step(rate, network, own);
            self.groups[i] = next;
        }
        network
    }

    pub(super) fn records(&self) -> (GroupRecord<B>, GroupRecord<B>) {
        (self.groups[0].to_record(), self.groups[1].to_record())
    }

    pub(super) fn load(&mut self, (weights, others): (GroupRecord<B>, GroupRecord<B>)) {
        self.groups[0] = self.groups[0].clone().load_record(weights);
        self.groups[1] = self.groups[1].clone().load_record(others);
    }
}

fn group<B: AutodiffBackend>(schedule: &Schedule, place: usize, momentum: f64) -> Group<B> {
    let nesterov = MomentumConfig::new().with_momentum(momentum).with_dampening(0.0).with_nesterov(true);
    let config = SgdConfig::new().with_momentum(Some(nesterov));
    let decay = (place == 0).then(|| WeightDecayConfig::new(schedule.weight_decay as f32));
    config.with_weight_decay(decay).init()
}

/// Parameters by group.
#[derive(Default)]
struct Members {
    weights: Vec<ParamId>,
    others: Vec<ParamId>,
}

impl<B: Backend> ModuleVisitor<B> for Members {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        if D > 1 { self.weights.push(param.id) } else { self.others.push(param.id) }
    }
}
