"""Many small bounded robust curve fits at once: the shape of the prediction model.

Letters: F fits, always the last axis; R records of a fit. The four parameters (A, a, b, c) are the first axis.
"""

import numpy as np

LOSS_SCALE = 0.05  # residuals beyond it count linearly
AMPLITUDE_LIMITS = (0.01, 1.0)  # the upper bound of A lies between these
STEEPNESS_BOUNDS = (0.1, 20.0)  # a
CENTRE_BOUNDS = (-5.0, 5.0)  # b
OFFSET_BOUNDS = (-1.0, 1.0)  # c

TOGETHER = 2**18  # numbers: a larger problem is worked off in parts
MOST_ITERATIONS = 100
CONVERGED = 1e-6  # a fit has ended if a step promises and yields less than this part of its cost
SMALLEST_DAMPING, FIRST_DAMPING, LARGEST_DAMPING = 1e-9, 1e-1, 1e9


def tanh_curve(parameters: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return `A tanh(a (x - b) / 2) + c` (Xu et al. 2020), parameters [4, F], x [R, F] -> [R, F]."""
    amplitude, steepness, centre, offset = parameters
    return amplitude * np.tanh(steepness * (x - centre) / 2) + offset


def fit_tanh(
    x: np.ndarray,  # [R, F]
    y: np.ndarray,  # [R, F]
    importance: np.ndarray,  # [R, F] factor of each residual; 0: not a record of this fit
) -> np.ndarray:  # [4, F]
    """Find the bounded soft-L1 fit of `tanh_curve` to each column of (x, y).

    Minimises `s^2 sum(sqrt(1 + (r / s)^2) - 1)`, where `r = importance (curve - y)` and s is the loss scale,
    by Levenberg-Marquardt on all fits together, with the damping of Nielsen (1999). Starts at
    half the range of y, 1, 0 and the mean of y. Every fit needs a record.

    Each fit costs as much as the one with the most records. So those of a large problem are made in parts of up to
    1, 2, 4, ... records.
    """
    if x.size <= TOGETHER:
        return _fit(x, y, importance)
    records = len(x) - np.argmax(importance[::-1] > 0, axis=0)  # [F] up to the last one
    parts = np.ceil(np.log2(records))
    parameters = np.empty((4, x.shape[1]))
    for each in np.unique(parts):
        fits = np.flatnonzero(parts == each)
        most = records[fits].max()
        parameters[:, fits] = _fit(x[:most, fits], y[:most, fits], importance[:most, fits])
    return parameters


def _fit(x: np.ndarray, y: np.ndarray, importance: np.ndarray) -> np.ndarray:  # [4, F]
    lower, upper, parameters = _box_and_start(y, importance > 0)
    cost = fit_cost(parameters, x, y, importance)
    damping = np.full_like(cost, FIRST_DAMPING)
    growth = np.full_like(cost, 2.0)  # of the damping, if the next step fails
    running = np.arange(len(cost))
    for _ in range(MOST_ITERATIONS):
        data = [np.take(each, running, axis=1) for each in (x, y, importance)]
        here = parameters[:, running]
        gradient, curvature = _derivatives(here, *data)
        there = _damped_step(here, gradient, curvature, damping[running], lower[:, running], upper[:, running])
        cost_there = fit_cost(there, *data)

        gain = cost[running] - cost_there
        promised = _promised_gain(there - here, gradient, curvature)
        better = gain > 0
        small = np.maximum(gain, promised) <= CONVERGED * cost[running]
        ended = (small & (damping[running] <= 1.0)) | (damping[running] >= LARGEST_DAMPING)

        parameters[:, running[better]] = there[:, better]
        cost[running[better]] = cost_there[better]
        ratio = gain / (np.maximum(promised, np.abs(gain)) + np.finfo(float).tiny)
        factor = np.where(better, np.maximum(1 / 3, 1 - (2 * ratio - 1) ** 3), growth[running])
        damping[running] = np.clip(damping[running] * factor, SMALLEST_DAMPING, LARGEST_DAMPING)
        growth[running] = np.where(better, 2.0, 2 * growth[running])
        running = running[~ended]
        if not running.size:
            break
    return parameters


def fit_cost(parameters: np.ndarray, x: np.ndarray, y: np.ndarray, importance: np.ndarray) -> np.ndarray:  # [F]
    """Return the loss that `fit_tanh` minimises."""
    squares = (importance * (tanh_curve(parameters, x) - y) / LOSS_SCALE) ** 2
    # q / (1 + sqrt(1 + q)) is sqrt(1 + q) - 1 without the cancellation near zero
    return LOSS_SCALE**2 * (squares / (1 + np.sqrt(1 + squares))).sum(axis=0)


def _box_and_start(y: np.ndarray, present: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower bounds, upper bounds and start of each fit, all [4, F]."""
    extent = np.where(present, y, -np.inf).max(axis=0) - np.where(present, y, np.inf).min(axis=0)
    mean = np.where(present, y, 0.0).sum(axis=0) / present.sum(axis=0)
    same = np.ones_like(extent)
    bounds = (STEEPNESS_BOUNDS, CENTRE_BOUNDS, OFFSET_BOUNDS)
    lower = np.stack([0 * same, *(low * same for low, _ in bounds)])
    upper = np.stack([np.clip(extent, *AMPLITUDE_LIMITS), *(high * same for _, high in bounds)])
    return lower, upper, np.clip([extent / 2, same, 0 * same, mean], lower, upper)


def _derivatives(
    parameters: np.ndarray, x: np.ndarray, y: np.ndarray, importance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient [4, F] of the cost, and its Gauss-Newton curvature [4, 4, F].

    The curvature includes the bend of the loss (Triggs et al. 2000); soft-L1 keeps it positive.
    """
    amplitude, steepness, centre, offset = parameters
    t = np.tanh(steepness * (x - centre) / 2)
    slope = amplitude * (1 - t**2) / 2
    jacobian = importance * np.stack([t, slope * (x - centre), -slope * steepness, np.ones_like(t)])  # [4, R, F]
    residual = importance * (amplitude * t + offset - y)
    flat_squared = 1 / (1 + (residual / LOSS_SCALE) ** 2)
    flat = np.sqrt(flat_squared)
    gradient = np.einsum("prf,rf->pf", jacobian, flat * residual)
    curvature = np.einsum("prf,qrf->pqf", jacobian, flat * flat_squared * jacobian)
    return gradient, curvature


def _promised_gain(step: np.ndarray, gradient: np.ndarray, curvature: np.ndarray) -> np.ndarray:  # [F]
    """How far the quadratic model of the cost falls along the step [4, F]."""
    return -np.einsum("pf,pf->f", step, gradient + np.einsum("pqf,qf->pf", curvature, step) / 2)


def _damped_step(
    parameters: np.ndarray,  # [4, F]
    gradient: np.ndarray,  # [4, F]
    curvature: np.ndarray,  # [4, 4, F]
    damping: np.ndarray,  # [F]
    lower: np.ndarray,  # [4, F]
    upper: np.ndarray,  # [4, F]
) -> np.ndarray:  # [4, F]
    """Where a Levenberg-Marquardt step within the box leads."""
    diagonal = np.einsum("ppf->pf", curvature)
    # a and b hardly matter where the curve is flat, and not at all where A = 0; their steps must stay moderate
    flat_too = diagonal[3] * np.maximum(1e-2 * parameters[0] ** 2, 1e-9)
    added = damping * np.maximum(diagonal, flat_too) + np.finfo(float).tiny
    system = curvature + np.eye(4)[:, :, None] * added
    held = ((parameters <= lower) & (gradient >= 0)) | ((parameters >= upper) & (gradient <= 0))
    target = parameters + _solve(system, -gradient, held, np.zeros_like(parameters))
    leaving = (target < lower) | (target > upper)
    if leaving.any():
        # what would leave the box stops at its wall, and the others follow from that
        stops = np.clip(target, lower, upper) - parameters
        target = parameters + _solve(system, -gradient, held | leaving, stops)
    return np.clip(target, lower, upper)


def _solve(system: np.ndarray, right: np.ndarray, fixed: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Solve the positive definite systems [4, 4, F] for [4, F], with the fixed unknowns at given values.

    Gaussian elimination, vectorised over the systems: many times faster than a LAPACK call for each.
    """
    at = np.where(fixed, at, 0.0)
    right = np.where(fixed, at, right - np.einsum("pqf,qf->pf", system, at))
    system = np.where(fixed[:, None] | fixed[None, :], 0.0, system) + np.eye(4)[:, :, None] * fixed
    for k in range(3):
        factor = system[k + 1 :, k] / system[k, k]
        right[k + 1 :] -= factor * right[k]
        system[k + 1 :, k:] -= factor[:, None] * system[k, k:]
    for k in (3, 2, 1, 0):
        right[k] = (right[k] - (system[k, k + 1 :] * right[k + 1 :]).sum(axis=0)) / system[k, k]
    return right
