"""Writes the reference values that the tests of the PPO update and of the advantages compare with.

A float64 implementation in PyTorch that shares nothing with jmorl: distributions, gradients, clipping and Adam
are PyTorch's own, and the advantages are written out as sums instead of a recursion. Before anything is written,
the updated parameters are checked against those of morl-baselines' `MOPPO.update` on the same batch.

    python -m venv .venv-peer && .venv-peer/bin/pip install -r benchmarks/peer/requirements.txt
    .venv-peer/bin/python benchmarks/peer/make_fixtures.py

Arrays of the file, all float64 unless said otherwise (B = 64, O = 3, A = 2, M = 2, T = 50):

- `settings/*` []: clip, value_coefficient, entropy_coefficient, max_gradient_norm, learning_rate, adam_epsilon
- `batch/*`: observations [B, O], actions [B, A], old_log_probabilities [B], old_values [B, M], advantages [B, M],
  returns [B, M], weights [M]
- `parameters/*`: actor/I/kernel [in, out], actor/I/bias [out] and the same of critic for the layers I = 0, 1, 2;
  log_std [A]
- `expected/*`: log_probabilities [B], values [B, M], normalized_advantages [B], and policy_loss, value_loss,
  entropy, total_loss, gradient_norm, all []; gradient_norm is the one before clipping
- `gradients/*`: as parameters; of total_loss, before clipping
- `changes_after_1_step/*`, `changes_after_3_steps/*`: as parameters, float32; updated minus initial parameters.
  A change says more than the updated value, of which it is a small part, and float32 keeps seven digits of it.
- `gae/*`: rewards, values, successor_values, advantages [T, M]; terminated, truncated [T] bool; discount, lambda []

Batch, parameters and trajectory have at most 11 significant bits: the same numbers in every precision.
"""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import torch
from morl_baselines.single_policy.ser.mo_ppo import MOPPO, MOPPONet
from torch.distributions import Independent, Normal

FIXTURE = Path(__file__).parents[2] / "tests" / "learning" / "fixtures" / "ppo_reference.npz"

B, O, A, M, T = 64, 3, 2, 2, 50  # noqa: E741
HIDDEN = 64

CLIP = 0.2
VALUE_COEFFICIENT = 0.5
ENTROPY_COEFFICIENT = 0.01
MAX_GRADIENT_NORM = 0.5
LEARNING_RATE = 3e-4
ADAM_EPSILON = 1e-5

DISCOUNT = 0.97
LAMBDA = 0.9
TERMINATED_AT = (7, 20, 21, 40)
TRUNCATED_AT = (13, 33, 34, 40)  # 40 is both; 21 and 34 end episodes of a single step

Arrays = dict[str, np.ndarray]
Tensors = dict[str, torch.Tensor]


def short(x: np.ndarray) -> np.ndarray:
    """`x` rounded to half precision, as float64."""
    return x.astype(np.float16).astype(np.float64)


def initial_parameters(rng: np.random.Generator) -> Arrays:
    """Random kernels and, so that no term is lost in a zero, random biases and log-std."""
    parameters = {"log_std": short(np.array([-0.4, 0.15]))}
    for network, outputs in (("actor", A), ("critic", M)):
        sizes = (O, HIDDEN, HIDDEN, outputs)
        for layer, (fan_in, fan_out) in enumerate(zip(sizes[:-1], sizes[1:], strict=True)):
            kernel = rng.normal(size=(fan_in, fan_out)) / np.sqrt(fan_in)
            parameters[f"{network}/{layer}/kernel"] = short(kernel)
            parameters[f"{network}/{layer}/bias"] = short(0.1 * rng.normal(size=fan_out))
    return parameters


def forward(parameters: Tensors, network: str, x: torch.Tensor) -> torch.Tensor:
    """Return the MLP `network` of x [B, O]: [B, outputs]."""
    for layer in range(3):
        x = x @ parameters[f"{network}/{layer}/kernel"] + parameters[f"{network}/{layer}/bias"]
        x = torch.tanh(x) if layer < 2 else x
    return x


def policy(parameters: Tensors, observations: torch.Tensor) -> Independent:
    """Return the distribution of the actions of each observation."""
    return Independent(Normal(forward(parameters, "actor", observations), parameters["log_std"].exp()), 1)


def initial_batch(parameters: Arrays, rng: np.random.Generator) -> Arrays:
    """Return a batch whose old log-probabilities and values are far enough from the present ones to be clipped."""
    tensors = as_tensors(parameters)
    observations = short(rng.normal(size=(B, O)))
    distribution = policy(tensors, torch.tensor(observations))
    actions = short(distribution.mean.numpy() + rng.normal(size=(B, A)))
    log_probabilities = distribution.log_prob(torch.tensor(actions)).numpy()
    values = forward(tensors, "critic", torch.tensor(observations)).numpy()
    return {
        "observations": observations,
        "actions": actions,
        "old_log_probabilities": short(log_probabilities + 0.3 * rng.normal(size=B)),
        "old_values": short(values + 0.3 * rng.normal(size=(B, M))),
        "advantages": short(rng.normal(size=(B, M)) * [1.0, 3.0] + [0.2, -0.5]),
        "returns": short(values + rng.normal(size=(B, M))),
        "weights": short(np.array([0.625, 0.375])),
    }


def as_tensors(arrays: Arrays) -> Tensors:
    """Float64 copies."""
    return {name: torch.tensor(array, dtype=torch.float64) for name, array in arrays.items()}


def losses(parameters: Tensors, batch: Tensors) -> Tensors:
    """Every quantity of one update, by name; `total_loss` carries the gradient."""
    distribution = policy(parameters, batch["observations"])
    log_probabilities = distribution.log_prob(batch["actions"])
    values = forward(parameters, "critic", batch["observations"])

    scalar = batch["advantages"] @ batch["weights"]
    advantages = (scalar - scalar.mean()) / (scalar.std(correction=1) + 1e-8)
    ratio = torch.exp(log_probabilities - batch["old_log_probabilities"])
    plain, clipped = ratio * advantages, ratio.clamp(1 - CLIP, 1 + CLIP) * advantages
    policy_loss = -torch.minimum(plain, clipped).mean()

    clipped_values = torch.clamp(values, batch["old_values"] - CLIP, batch["old_values"] + CLIP)
    errors = torch.stack([(values - batch["returns"]) ** 2, (clipped_values - batch["returns"]) ** 2])
    value_loss = 0.5 * errors.amax(0).mean()

    entropy = distribution.entropy().mean()
    return {
        "log_probabilities": log_probabilities,
        "values": values,
        "normalized_advantages": advantages,
        "policy_loss": policy_loss,
        "value_loss": value_loss,
        "entropy": entropy,
        "total_loss": policy_loss + VALUE_COEFFICIENT * value_loss - ENTROPY_COEFFICIENT * entropy,
    }


def updated(parameters: Arrays, batch: Arrays, steps: int) -> Arrays:
    """Return the parameters after `steps` clipped Adam steps, all on the whole batch."""
    leaves = {name: tensor.requires_grad_() for name, tensor in as_tensors(parameters).items()}
    tensors = as_tensors(batch)
    optimizer = torch.optim.Adam(list(leaves.values()), lr=LEARNING_RATE, eps=ADAM_EPSILON)
    for _ in range(steps):
        optimizer.zero_grad()
        quantities = losses(leaves, tensors)
        require_clear_of_kinks(quantities, tensors)
        quantities["total_loss"].backward()
        torch.nn.utils.clip_grad_norm_(list(leaves.values()), MAX_GRADIENT_NORM)
        optimizer.step()
    return {name: leaf.detach().numpy() for name, leaf in leaves.items()}


def require_clear_of_kinks(quantities: Tensors, batch: Tensors) -> None:
    """No sample so near to where clipping begins that rounding in float32 decides whether it is clipped.

    Raises RuntimeError otherwise; another seed helps.
    """
    ratio = torch.exp(quantities["log_probabilities"] - batch["old_log_probabilities"])
    change = quantities["values"] - batch["old_values"]
    margin = min(((ratio - 1).abs() - CLIP).abs().min().item(), (change.abs() - CLIP).abs().min().item())
    if margin < 1e-4:
        raise RuntimeError(f"a sample lies {margin:.1e} from the edge of clipping; choose another seed")


def clipped_shares(quantities: Tensors, batch: Tensors) -> dict[str, float]:
    """How many samples each kind of clipping stops or bounds, as shares of the batch."""
    ratio = torch.exp(quantities["log_probabilities"] - batch["old_log_probabilities"])
    good = quantities["normalized_advantages"] > 0
    change = quantities["values"] - batch["old_values"]
    clipped_values = batch["old_values"] + change.clamp(-CLIP, CLIP)
    worse = (clipped_values - batch["returns"]).abs() > (quantities["values"] - batch["returns"]).abs()
    flags = {
        "ratio above, gradient stopped": (ratio > 1 + CLIP) & good,
        "ratio above, gradient kept": (ratio > 1 + CLIP) & ~good,
        "ratio below, gradient stopped": (ratio < 1 - CLIP) & ~good,
        "ratio below, gradient kept": (ratio < 1 - CLIP) & good,
        "value above, gradient stopped": (change > CLIP) & worse,
        "value above, gradient kept": (change > CLIP) & ~worse,
        "value below, gradient stopped": (change < -CLIP) & worse,
        "value below, gradient kept": (change < -CLIP) & ~worse,
    }
    return {name: flag.double().mean().item() for name, flag in flags.items()}


def updated_by_morl_baselines(parameters: Arrays, batch: Arrays, steps: int) -> Arrays:
    """Compute what `updated` says by morl-baselines: one minibatch, an epoch a step."""
    networks = MOPPONet((O,), (A,), M, [HIDDEN, HIDDEN]).double()
    linears = {
        f"{name}/{layer}": linear
        for name, network in (("actor", networks.actor_mean), ("critic", networks.critic))
        for layer, linear in enumerate(m for m in network.modules() if isinstance(m, torch.nn.Linear))
    }
    with torch.no_grad():
        networks.actor_logstd[0] = torch.tensor(parameters["log_std"])
        for name, linear in linears.items():
            linear.weight.copy_(torch.tensor(parameters[f"{name}/kernel"].T))
            linear.bias.copy_(torch.tensor(parameters[f"{name}/bias"]))
    agent = MOPPO(
        id=0,
        networks=networks,
        weights=batch["weights"],
        envs=SimpleNamespace(num_envs=B),
        steps_per_iteration=1,
        num_minibatches=1,
        update_epochs=steps,
        learning_rate=LEARNING_RATE,
        clip_coef=CLIP,
        ent_coef=ENTROPY_COEFFICIENT,
        vf_coef=VALUE_COEFFICIENT,
        max_grad_norm=MAX_GRADIENT_NORM,
        device="cpu",
    )
    tensors = as_tensors(batch)
    agent.batch.obs = tensors["observations"][None]
    agent.batch.actions = tensors["actions"][None]
    agent.batch.logprobs = tensors["old_log_probabilities"][None]
    agent.batch.values = tensors["old_values"][None]
    agent.returns = tensors["returns"][None]
    agent.advantages = (tensors["advantages"] @ tensors["weights"])[None]
    agent.update()
    result = {"log_std": networks.actor_logstd[0].detach().numpy()}
    for name, linear in linears.items():
        result[f"{name}/kernel"] = linear.weight.detach().numpy().T
        result[f"{name}/bias"] = linear.bias.detach().numpy()
    return result


def changes(parameters: Arrays, batch: Arrays, steps: int) -> Arrays:
    """Return updated minus initial parameters, float32, once both implementations agree on them."""
    ours, theirs = updated(parameters, batch, steps), updated_by_morl_baselines(parameters, batch, steps)
    for name, parameter in ours.items():
        np.testing.assert_allclose(parameter, theirs[name], rtol=0, atol=1e-12, err_msg=name)
    return {name: (ours[name] - parameters[name]).astype(np.float32) for name in parameters}


def update_fixture(rng: np.random.Generator) -> Arrays:
    """Batch, parameters, losses, gradients and changes, by the names above."""
    parameters = initial_parameters(rng)
    batch = initial_batch(parameters, rng)
    leaves = {name: tensor.requires_grad_() for name, tensor in as_tensors(parameters).items()}
    quantities = losses(leaves, as_tensors(batch))
    derivatives = torch.autograd.grad(quantities["total_loss"], list(leaves.values()))
    gradients = {name: derivative.numpy() for name, derivative in zip(leaves, derivatives, strict=True)}
    expected = {name: quantity.detach().numpy() for name, quantity in quantities.items()}
    expected["gradient_norm"] = np.sqrt(sum((gradient**2).sum() for gradient in gradients.values()))
    for name, share in clipped_shares(quantities, as_tensors(batch)).items():
        print(f"{name}: {share:.0%}")
    print(f"gradient norm: {expected['gradient_norm']:.3f}")
    return {
        **prefixed("batch", batch),
        **prefixed("parameters", parameters),
        **prefixed("expected", expected),
        **prefixed("gradients", gradients),
        **prefixed("changes_after_1_step", changes(parameters, batch, steps=1)),
        **prefixed("changes_after_3_steps", changes(parameters, batch, steps=3)),
    }


def settings_fixture() -> Arrays:
    """Return the settings of the update."""
    settings = {
        "clip": CLIP,
        "value_coefficient": VALUE_COEFFICIENT,
        "entropy_coefficient": ENTROPY_COEFFICIENT,
        "max_gradient_norm": MAX_GRADIENT_NORM,
        "learning_rate": LEARNING_RATE,
        "adam_epsilon": ADAM_EPSILON,
    }
    return prefixed("settings", {name: np.array(value) for name, value in settings.items()})


def gae_fixture(rng: np.random.Generator) -> Arrays:
    """One trajectory across several endings of both kinds, the last step not being one."""
    rewards, values, after_endings = (short(rng.normal(size=(T, M))) for _ in range(3))
    terminated, truncated = (np.isin(np.arange(T), at) for at in (TERMINATED_AT, TRUNCATED_AT))
    next_values = np.concatenate([values[1:], after_endings[-1:]])
    successor_values = np.where((terminated | truncated)[:, None], after_endings, next_values)
    return prefixed(
        "gae",
        {
            "rewards": rewards,
            "values": values,
            "successor_values": successor_values,
            "terminated": terminated,
            "truncated": truncated,
            "discount": np.array(DISCOUNT),
            "lambda": np.array(LAMBDA),
            "advantages": advantages_as_sums(rewards, values, successor_values, terminated, truncated),
        },
    )


def advantages_as_sums(
    rewards: np.ndarray,  # [T, M]
    values: np.ndarray,  # [T, M]
    successor_values: np.ndarray,  # [T, M]
    terminated: np.ndarray,  # [T] bool
    truncated: np.ndarray,  # [T] bool
) -> np.ndarray:  # [T, M]
    """A_t = sum over k of (gamma lambda)^k delta_{t+k}, up to the first ending (Schulman et al. 2016, eq. 16)."""
    advantages = np.zeros((T, M))
    for t in range(T):
        for objective in range(M):
            for k in range(T - t):
                i = t + k
                bootstrap = 0.0 if terminated[i] else DISCOUNT * successor_values[i, objective]
                delta = rewards[i, objective] + bootstrap - values[i, objective]
                advantages[t, objective] += (DISCOUNT * LAMBDA) ** k * delta
                if terminated[i] or truncated[i]:
                    break
    return advantages


def prefixed(prefix: str, arrays: Arrays) -> Arrays:
    """Return the same arrays under `prefix/name`."""
    return {f"{prefix}/{name}": array for name, array in arrays.items()}


def main() -> None:
    """Write the fixture."""
    torch.set_num_threads(1)
    rng = np.random.default_rng(2)
    arrays = {**settings_fixture(), **update_fixture(rng), **gae_fixture(rng)}
    FIXTURE.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(FIXTURE, allow_pickle=False, **arrays)
    print(f"{len(arrays)} arrays, {FIXTURE.stat().st_size} bytes: {FIXTURE}")


if __name__ == "__main__":
    main()
