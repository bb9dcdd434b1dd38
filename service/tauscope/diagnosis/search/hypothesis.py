"""One set of effects beside the nominal model, at its most probable parameters, with its evidence."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tauscope.diagnosis.evidence.bodies import BodyPrior, NormalBodies
from tauscope.diagnosis.evidence.linear_model import LinearModel, Posterior
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.fitting.bounded_step import bounded_step
from tauscope.diagnosis.model.extended import STATED_ERROR, ExtendedModel, move_model, with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.observations.observations import FINEST
from tauscope.identification import Identification
from tauscope.recording.recording import Array

SLOPE_SPREAD = 1.0  # standard deviation of the logarithm of a friction slope that the robot file does not state
HELD_SPREAD = 1e-6  # …that is held
SHAPE_SPREAD = 1.0  # …of a shape that is searched by its logarithm
RANGE_SPREAD = 1.0 / np.sqrt(12.0)  # …of another shape, relative to its range: that of a uniform distribution
LARGEST_LOG_STEP = 0.5  # change of a logarithm in one step: columns are straight over no more
LARGEST_SHAPE_STEP = 0.15  # change of another shape in one step, relative to its range
HALVINGS = (1.0, 0.5, 0.25, 0.1)  # parts of a step that are tried until the data are more probable
WEIGHINGS = 5  # rounds of dependence and scales, at most…
ALIKE = 0.5  # …which end where the logarithm of κ changes by less
NEAR = 3  # steps to parameters by which effects are compared
BODY_STEPS = 20  # steps of the bodies within one of those, at most: a volume a million times too small doubles as often
STEPS = 8  # most steps to the most probable parameters
ROUNDING = 1e-3  # part of its standard error by which rounding may leave a coefficient beyond a bound
PROGRESS = 0.1  # gain in log probability below which a step is the last


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A model and what the data say of it."""

    model: ExtendedModel
    sizes: tuple[Array, ...]  # tuple of (c,), standard deviation believed of every term's coefficients
    linear: LinearModel  # about the model, coefficients that would pass a bound held there
    free: LinearModel  # what is believed, with none held
    bodies: NormalBodies
    scales: tuple[Scales, ...]  # one entry a joint
    dependence: tuple[float, ...]  # κ of every joint

    @cached_property
    def posterior(self) -> Posterior:
        """Steps of all parameters from the model, and their covariance."""
        return self.linear.posterior(self.scales)

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence of data and scales."""
        return self.bodies.log_mass + self.posterior.log_evidence - sum(each.penalty() for each in self.scales)

    @cached_property
    def misfit(self) -> float:
        """-2 log probability of data and parameters as they are, but for what depends on the scales alone."""
        others = slice(len(self.bodies.mean), None)
        off = self.free.mean[others]
        believed = self.bodies.energy + float(off @ self.free.precision[others, others] @ off)
        pairs = zip(self.linear.joints, self.scales, strict=True)
        return believed + sum(float(own.weighted(scales).products[0, 0]) for own, scales in pairs)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is believed of a nominal model's parameters."""

    bodies: BodyPrior
    friction: Array  # (f, f), precision of the friction coefficients about zero
    slopes: Array  # (s,), logarithms of friction's slopes
    slope_spreads: Array  # (s,), their standard deviations

    @staticmethod
    def of(identification: Identification, model: ExtendedModel) -> "Prior":
        """That of an identification; its rotors, which are effects here, are left out."""
        structure, posterior = identification.structure, identification.posterior
        joints = range(structure.robot.joint_count)
        rotors = [structure.coefficient(joint, "rotor_inertia") for joint in joints]
        own = [place for place in range(structure.base_count, structure.size) if place not in rotors]
        covariance = np.linalg.inv(posterior.precision)[np.ix_(own, own)]
        spreads = [SLOPE_SPREAD if stated is None else STATED_ERROR for stated in model.stated]
        friction = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        return Prior(BodyPrior.of(identification), friction, _slopes(model), np.array(spreads))


@dataclass(frozen=True, eq=False)
class Laboratory:
    """Makes hypotheses about the same rows."""

    rows: EvidenceRows
    prior: Prior
    repeated: bool = False  # whether repetitions of the motion tell the noise

    def start(self, model: ExtendedModel) -> Hypothesis:
        """The nominal model with bodies that have volume, under scales of highest evidence."""
        links = self.prior.bodies.start(model.links)
        parameters = model.parameters.copy()
        count = len(self.prior.bodies.base)
        parameters[:count] = self.prior.bodies.base @ links
        nominal = replace(model, parameters=parameters, links=links)
        dependence = [1.0] * model.structure.robot.joint_count
        moments = self.rows.moments(nominal, dependence)
        levels = [float(np.sqrt(np.mean(own.rows[0] ** 2))) if own.rows.size else 1.0 for own in moments]
        finest = [FINEST * self.rows.measured_rms(joint, 1.0) for joint in range(len(levels))]
        scales = [
            Scales.start(level, repeated=self.repeated, finest=least)
            for level, least in zip(levels, finest, strict=True)
        ]
        at = self.at(nominal, (), scales, dependence)
        return self.settle(self.settle(at, range(len(levels))), range(len(levels)))

    def at(
        self,
        model: ExtendedModel,
        sizes: Sequence[Array],
        scales: Sequence[Scales],
        dependence: Sequence[float],
        *,
        owned: bool = False,
    ) -> Hypothesis:
        """A model as it is.

        Evidence asks whether an effect is more probable than torque without a name, which may look like it. Where an
        effect is `owned` it is believed, and no such torque takes a part of it.
        """
        bodies = self.prior.bodies.about(model.links)
        mean, precision = np.zeros(model.size), np.zeros((model.size, model.size))
        base, plain = len(bodies.mean), model.structure.size
        mean[:base] = bodies.mean - model.parameters[:base]
        precision[:base, :base] = bodies.precision
        mean[base:plain] = -model.parameters[base:]
        precision[base:plain, base:plain] = self.prior.friction
        spread = np.ones(model.size)
        slopes = slice(plain, plain + len(model.constants))
        mean[slopes], spread[slopes] = self.prior.slopes - _slopes(model), self.prior.slope_spreads
        for term, place, size in zip(model.terms, model.term_places(), sizes, strict=True):
            count = len(term.coefficients)
            mean[place.start : place.start + count] = -term.coefficients
            spread[place] = np.concatenate([size, _shape_spreads(term)])
        diagonal = np.arange(plain, model.size)
        precision[diagonal, diagonal] = 1.0 / spread[plain:] ** 2
        free = LinearModel(self.rows.moments(model, dependence, owned=owned), mean, precision)
        held = _hold_impossible(free, model, scales)
        return Hypothesis(model, tuple(sizes), held, free, bodies, tuple(scales), tuple(dependence))

    def settle(self, start: Hypothesis, joints: Collection[int]) -> Hypothesis:
        """The most probable parameters, and scales of highest evidence at some joints."""
        at = self.weigh(self.tune(start, joints), joints)
        estimate = self.approach(at, STEPS)
        return self.weigh(self.at(estimate.model, at.sizes, at.scales, at.dependence), joints)

    def approach(self, at: Hypothesis, steps: int = NEAR) -> Hypothesis:
        """The hypothesis after a few steps towards its most probable parameters, its effects believed."""
        estimate = self._own(at)
        for _ in range(steps):
            nearer = self._nearer(estimate)
            if nearer is None:
                break
            gained, estimate = estimate.misfit - nearer.misfit, nearer
            if gained < 2.0 * PROGRESS:
                break
        return estimate

    def _own(self, at: Hypothesis) -> Hypothesis:
        """The same with all effects believed, so that the discrepancy takes no part of them, and independent rows."""
        return self.at(at.model, at.sizes, at.scales, [1.0] * len(at.scales), owned=True)

    def tune(self, at: Hypothesis, joints: Collection[int], *, anew: bool = True) -> Hypothesis:
        """The same model under scales of highest evidence."""
        return replace(at, scales=at.linear.most_probable(at.scales, joints, anew=anew))

    def weigh(self, at: Hypothesis, joints: Collection[int]) -> Hypothesis:
        """The same model under scales of highest evidence, rows counting as much as its best residual lets them."""
        for _ in range(WEIGHINGS):
            dependence = self._dependence(at, joints)
            moved = max(abs(np.log(dependence[joint] / at.dependence[joint])) for joint in joints)
            at = self.tune(self.under(at, dependence, joints), joints, anew=False)
            if moved < ALIKE:
                break
        return at

    def _dependence(self, at: Hypothesis, joints: Collection[int]) -> list[float]:
        """κ of every joint, of some by what the most probable parameters leave there if rows are independent."""
        independent = self.under(at, [1.0] * len(at.scales), range(len(at.scales)))
        dependence, mean = list(at.dependence), independent.posterior.mean
        for joint in joints:
            own = independent.linear.joints[joint]
            direction = np.concatenate([[1.0], -mean[own.index]])
            left = direction @ own.rows[: own.visible] - own.discrepancy(at.scales[joint], direction)
            dependence[joint] = self.rows.dependence(joint, left)
        return dependence

    def under(self, at: Hypothesis, dependence: Sequence[float], joints: Collection[int]) -> Hypothesis:
        """The same with another dependence of some joints' rows."""
        moments, counted = list(at.linear.joints), list(at.dependence)
        for joint in joints:
            moments[joint] = moments[joint].counting(at.dependence[joint] / dependence[joint])
            counted[joint] = dependence[joint]
        return replace(at, linear=replace(at.linear, joints=tuple(moments)), dependence=tuple(counted))

    def paint(self, at: Hypothesis, like: Hypothesis) -> Hypothesis:
        """The same model under another hypothesis' scales."""
        return self.at(at.model, at.sizes, like.scales, like.dependence)

    def with_slopes_of(self, at: Hypothesis) -> "Laboratory":
        """The same, sure of friction's slopes."""
        spreads = np.full(len(self.prior.slopes), HELD_SPREAD)
        return replace(self, prior=replace(self.prior, slopes=_slopes(at.model), slope_spreads=spreads))

    def _nearer(self, at: Hypothesis) -> Hypothesis | None:
        """The model after a step under which data and parameters are more probable; None where there is none."""
        step, links = self._step(at)
        for part in HALVINGS:
            own = np.clip(part * step, *_bounds(at.model))
            moved = replace(move_model(at.model, own), links=at.model.links + part * links)
            found = self.at(moved, at.sizes, at.scales, at.dependence, owned=True)
            if found.misfit < at.misfit:
                return found
        return None

    def _step(self, at: Hypothesis) -> tuple[Array, Array]:
        """The most probable step of parameters and links while columns stay as they are.

        A body that is nearly without volume cannot tell how far away the most probable one is: Newton's steps double
        its volume at best. So the prior is expanded anew on the way.
        """
        base, prior = len(at.bodies.mean), self.prior.bodies
        step, start, links = np.zeros(at.model.size), at.model.parameters[:base], at.model.links
        for _ in range(BODY_STEPS):
            wanted = _limit(at)
            farther = at.bodies.links(start + wanted[:base]) - links
            share = prior.share(links, farther)
            moved = share * (wanted - step)
            step, links = step + moved, links + share * farther
            bodies = prior.about(links)
            if share == 1.0 and float(moved[:base] @ bodies.precision @ moved[:base]) < PROGRESS:
                break
            mean, precision = at.linear.mean.copy(), at.linear.precision.copy()
            mean[:base], precision[:base, :base] = bodies.mean - start, bodies.precision
            at = replace(at, bodies=bodies, linear=replace(at.linear, mean=mean, precision=precision))
        return step, links - at.model.links

    def with_term(self, at: Hypothesis, term: Term, size: Array) -> Hypothesis:
        """A model with one effect more, as it is. `size`: (c,), standard deviation believed of its coefficients."""
        return self.at(with_terms(at.model, [*at.model.terms, term]), [*at.sizes, size], at.scales, at.dependence)

    def without_term(self, at: Hypothesis, place: int) -> Hypothesis:
        """A model with one effect less, as it is. `place`: of the effect among the model's terms."""
        terms = [term for at_place, term in enumerate(at.model.terms) if at_place != place]
        sizes = [size for at_place, size in enumerate(at.sizes) if at_place != place]
        return self.at(with_terms(at.model, terms), sizes, at.scales, at.dependence)


def _hold_impossible(linear: LinearModel, model: ExtendedModel, scales: Sequence[Scales]) -> LinearModel:
    """The same with coefficients held at the bound that they would else pass: friction takes power, it gives none."""
    lower, upper = _bounds(model)
    places = np.flatnonzero(np.isfinite(lower) | np.isfinite(upper))
    held, bounds, found = np.zeros(len(places), dtype=bool), np.zeros(len(places)), linear
    for _ in range(2 * len(places)):
        posterior = found.posterior(scales)
        mean, width = posterior.mean[places], np.linalg.norm(posterior.spread[places], axis=1)
        beyond = np.maximum(lower[places] - mean, mean - upper[places]) / width
        freed = held & (beyond < 0.0)
        if freed.any():
            held &= ~freed
        elif held.all() or beyond[~held].max() <= ROUNDING:
            break
        else:
            most = np.flatnonzero(~held)[np.argmax(beyond[~held])]
            held[most], bounds[most] = True, np.clip(mean[most], lower[places[most]], upper[places[most]])
        found = linear.hold(places[held], bounds[held])
    return found


def _bounds(model: ExtendedModel) -> tuple[Array, Array]:
    """Least and largest steps of the parameters, (p,) each."""
    lower, upper = np.full(model.size, -np.inf), np.full(model.size, np.inf)
    for joint in range(model.structure.robot.joint_count):
        for name in ("stiction", "viscous"):
            place = model.structure.coefficient(joint, name)
            if place is not None:
                lower[place] = -model.parameters[place]
    for term, place in zip(model.terms, model.term_places(), strict=True):
        for number, (coefficient, value) in enumerate(zip(term.effect.coefficients, term.coefficients, strict=True)):
            if coefficient.positive:
                lower[place.start + number] = -value
            upper[place.start + number] = coefficient.whole - value
    return lower, upper


def _slopes(model: ExtendedModel) -> Array:
    """Logarithms of friction's slopes, (s,)."""
    return np.log([model.constant(place) for place in range(len(model.constants))])


def _shape_spreads(term: Term) -> Array:
    """Standard deviations believed of a term's free shapes, (f,)."""
    effect = term.effect
    return np.array(
        [
            SHAPE_SPREAD * abs(float(term.shape[place]))
            if effect.shapes[place].logarithmic
            else RANGE_SPREAD * float(effect.upper[place] - effect.lower[place])
            for place in term.free_shapes
        ]
    )


def _limit(at: Hypothesis) -> Array:
    """The most probable step within which the columns of curved parameters are straight, and these in their bounds."""
    rows, first = [], at.model.structure.size
    rows += [(first + place, -np.inf, np.inf, LARGEST_LOG_STEP) for place in range(len(at.model.constants))]
    for term, place in zip(at.model.terms, at.model.term_places(), strict=True):
        effect = term.effect
        for number, free in enumerate(term.free_shapes, start=place.start + len(term.coefficients)):
            value, low, high = float(term.shape[free]), float(effect.lower[free]), float(effect.upper[free])
            reach = (
                LARGEST_LOG_STEP * abs(value) if effect.shapes[free].logarithmic else LARGEST_SHAPE_STEP * (high - low)
            )
            rows.append((number, min(low - value, 0.0), max(high - value, 0.0), max(reach, np.finfo(float).tiny)))
    places, lower, upper, reach = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return bounded_step(
        at.posterior.mean,
        at.posterior.spread,
        places.astype(np.intp),
        np.maximum(lower, -reach),
        np.minimum(upper, reach),
        reach,
    )
