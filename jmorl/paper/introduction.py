"""What a reader of the report has to know before its numbers."""

INTRODUCTION = """Made by `jmorl paper` from the records in `records/`; nothing here is written by hand.

The paper's experiments are repeated twice. In **raw units** a score is a mean undiscounted return with deterministic
actions, which means the same in every run and at every time; methods have this project's default settings, and targets
were fixed beforehand. In **paper units** policies are scored as the authors' program scores them, with sampled actions,
by rewards divided by a running deviation (sigma) that every policy scored so far has moved; settings and targets are
the published ones. Such units drift: fixed policies reach targets with nothing learned (`python -m benchmarks.drift`).

**What was chosen on which seeds.** The default settings, used in raw units, were not chosen on seeds of their own.
MountainCar's learning rates and its charge for mean actions beyond the box were chosen on seeds 1, 7, 10, 42 and 100,
which are the experiment's, for the interactive method and user C, whose shortfall they lower from 2.7 to 1.7 %; PGMORL
pays for them with 0.98 and 1.61 % for users A and B in place of 0.82 and 1.22 %. The other settings there were chosen
on one or two of these seeds, HalfCheetah's sizes and its warm-up on seed 1. So differences in raw units may favour the
interactive method. HalfCheetah's warm-up of 120 iterations, in place of the paper's 40, does: it saves the interactive
method from bounds around policies that do not run yet, and costs PGMORL, which has no bounds, some of what it saves (on
seed 1, PGMORL has a hypervolume of 20e6 after 3.46 M steps instead of 1.54 M, and ends at utilities of 1,430, 2,234 and
644 for A, B and C instead of 1,607, 2,802 and 581; `benchmarks/README.md`, "HalfCheetah"). Therefore PGMORL has a
second row there in raw units, with a warm-up of 40, and the interactive method is compared with the better of the two.
Targets in raw units were chosen without the experiment's runs.

**What is copied and what is not, in paper units.** Copied are settings, units that drift, untrained policies scored
before the warm-up, weights that act on rewards in units of their running deviation, two policies a direction in the
performance buffer, and on HalfCheetah a discount of 0.995 for the agents, whose setting of 0.99 there only reaches the
scorer. Not copied are: the scale of rewards in training, which there belongs to each training environment, is shared by
all agents that train in it and clips at 10, and here belongs to each agent; observation statistics, which there are
shared by all policies, in training and evaluation, and here belong to each policy; the bounds, which there take the
place of the chosen policy's values when no policy lies within them; a full direction of the buffer, where there the
first weaker policy gives way and here the weakest; the first generation, before which there nobody is asked; and the
check of the targets, which there comes after generations only, and here after the warm-up, too. Successes with
generation 0 are therefore listed apart.

Steps are environment steps used for learning. A run that does not reach a target is censored at the table's cap, ours
as the paper's, so that mean steps are *restricted* means: steps used, time-outs at the cap. A run's last generation is
a whole one; what it finds after the cap does not count. Brackets beside a mean are 95 % percentile bootstrap intervals
over seeds, which are rather too narrow with so few. Differences are paired by seed, with a 95 % t interval: "clearly"
means that it excludes 0. Runs that broke down count as not reaching what they had not reached, and are left out of
figures. Times leave compilation out."""

DIFFERENT_UNITS = (
    "Values of different runs are in different units here, so that comparing them, as the paper does, means little."
)

DEVIATIONS = (
    "Published are mean ± standard deviation; all in million steps. 'No results' is what the paper prints where all "
    "five runs timed out: with time-outs at the cap, as in its other rows, the mean is the cap."
)

SWAPPED = (
    "The paper prints the standard deviations of rows B and C the other way round, for both methods. With four "
    "time-outs at the cap the fifth run follows from the mean, and the deviation with it: 2.84 for the interactive "
    "method in row B and 2.15 for PGMORL in row C, as derived here, and not as printed."
)

MEAN_UTILITY = (
    "Judged are the policies just trained in each generation, which no bounds have filtered. What the authors measure "
    "stands beside it: the mean of the performance buffer, and, as they take it for the interactive method, of its "
    "members within the bounds, which favours that method by construction. In raw units the bounds also decide how its "
    "buffer is sorted."
)

POOLED = (
    "E-NAUTILUS chooses from the pooled archives of {runs} runs, and so has {runs} times the steps of one interactive "
    "run behind it."
)
