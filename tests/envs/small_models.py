"""Small planar models, each unlike the half cheetah in other ways."""

import mujoco
import numpy as np

from tests.envs.mujoco_reference import States

_ROOT = """
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="turn" axis="0 1 0"/>"""

# A rod upright, drawn from its upper end to its lower, without other joints or actuators; all of MuJoCo's defaults.
ROD = f"""
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1"/>
    <body name="rod" pos="0 0 0.2">{_ROOT}
      <geom name="rod" type="capsule" size="0.1" fromto="0 0 0.2 0 0 0"/>
    </body>
  </worldbody>
</mujoco>"""

# One hinge besides the root's, limited, and a motor.
FLAIL = f"""
<mujoco>
  <default><geom type="capsule" size="0.08" contype="1" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1" contype="0" conaffinity="1"/>
    <body name="handle" pos="0 0 0.3">{_ROOT}
      <geom name="handle" fromto="-0.3 0 0 0.3 0 0"/>
      <body name="head" pos="0.3 0 0">
        <joint name="swing" axis="0 1 0" limited="true" range="-50 50" damping="0.1"/>
        <geom name="head" fromto="0 0 0 0.3 0 0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="swing" joint="swing" gear="5"/></actuator>
</mujoco>"""

# Two children at unequal depth, a body without a capsule between others, hinges about -y and away from their bodies'
# origins, bodies turned about y, reference and spring positions, priorities, powers, a raised ground, other gravity,
# joints with two actuators, one on a slide, one without a range, and a box that touches nothing.
TREE = """
<mujoco>
  <option timestep="0.005" gravity="0 0 -3.7" impratio="2.5"/>
  <default>
    <geom type="capsule" size="0.05" contype="1" conaffinity="0"/>
    <joint type="hinge" axis="0 1 0"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1" pos="1 2 -0.4" contype="0" conaffinity="1" priority="1"
          friction="0.3 0.1 0.1" solref="0.03 0.7" solimp="0.5 0.95 0.02 0.3 3" solmix="2"/>
    <body name="trunk" pos="0.3 0 0.2">
      <joint name="x" type="slide" axis="1 0 0" damping="0.3" stiffness="2" ref="0.2" springref="0.5" armature="0.2"/>
      <joint name="z" type="slide" axis="0 0 1" damping="0.1" ref="-0.1" armature="0.1"/>
      <joint name="turn" axis="0 -1 0" pos="0.1 0 -0.05" ref="0.3" springref="-0.4" stiffness="1.5" damping="0.2"/>
      <geom name="trunk" fromto="-0.3 0 0 0.3 0 0.1" friction="0.9 0.1 0.1"/>
      <geom name="keel" fromto="0 0 0 0 0 -0.2" friction="0.6 0.1 0.1" priority="1" solref="0.05 1.2" solmix="0.5"
            solimp="0.1 0.9 0.01 0.6 3"/>
      <body name="lump" pos="0.4 0 0.1" euler="0 35 0">
        <joint name="lump" axis="0 -1 0" pos="-0.05 0 0.02" stiffness="3" springref="0.2" ref="0.1"/>
        <inertial pos="0.05 0 0.02" mass="0.7" diaginertia="0.01 0.02 0.015" euler="0 20 0"/>
        <body name="far" pos="0.2 0 -0.1" euler="0 -80 0">
          <joint name="far" damping="0.3" limited="true" range="-40 60" solimplimit="0.2 0.9 0.05 0.4 3"
                 solreflimit="0.04 0.8"/>
          <geom name="far" fromto="0 0 0 0.3 0 -0.2" priority="2" friction="0.2 0.1 0.1" solref="0.06 0.5"/>
          <geom name="pad" type="box" size="0.02 0.1 0.03" contype="0" pos="0.1 0.2 0"/>
        </body>
        <body name="near" pos="-0.1 0 0.2">
          <joint name="near" limited="true" range="-30 30" ref="5"/>
          <geom name="near" fromto="0 0 0 0 0 0.25" contype="0"/>
        </body>
      </body>
      <body name="arm" pos="-0.4 0 0.05">
        <joint name="arm" pos="0 0 0.03" armature="0.02" damping="0.05"/>
        <geom name="arm" fromto="0 0 0 -0.2 0 -0.3" solmix="0" solref="0.01 1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="far" gear="3" ctrllimited="true" ctrlrange="-0.5 0.8"/>
    <motor joint="far" gear="-1.5"/>
    <motor joint="x" gear="2"/>
    <motor joint="turn" gear="0.3"/>
    <motor joint="arm" gear="0.5"/>
    <general joint="lump" gear="2" gainprm="1.5"/>
  </actuator>
</mujoco>"""

# Parameters of both geoms mixed by weight, stiff ones allowed, capsules off the plane's middle, a limit on the root's
# hinge, a limb of inertia alone and turned out of the plane, no friction, several capsules on a body.
MIXTURE = """
<mujoco>
  <option timestep="0.004"><flag refsafe="disable"/></option>
  <default>
    <geom type="capsule" size="0.05" contype="1" conaffinity="0"/>
    <joint type="hinge" axis="0 1 0"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1" pos="1 2 0.1" contype="0" conaffinity="1" friction="0.5 0.1 0.1"
          solref="0.03 0.7" solimp="0.5 0.95 0.02 0.3 1" solmix="2"/>
    <body name="trunk" pos="0.3 0 0.2">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="turn" limited="true" range="-20 30"/>
      <geom name="a" fromto="0 0 -0.3 0 0 0" solmix="3" friction="0.9 0.1 0.1"/>
      <geom name="b" fromto="0 0.3 0 0 0.3 -0.3" solmix="1" friction="0.1 0.1 0.1" solimp="0.5 0.5 0.02 0.3 1"/>
      <body name="c" pos="0.1 0 0.1"><joint/><geom fromto="0 0 0 0.4 0 0" solmix="0" solref="0.005 1"/></body>
      <body name="d" pos="-0.1 0 0.1"><joint/>
        <inertial pos="0.1 0.4 0.2" mass="0.3" diaginertia="0.01 0.02 0.015" euler="20 30 10"/>
      </body>
      <body name="e" pos="-0.1 0 0.1"><joint/>
        <geom fromto="0 0 0 -0.4 0 -0.1" friction="0 0 0"/>
        <geom fromto="0 0 0 -0.4 0 0.3"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""

# A chain that folds onto itself, and a branch: what touches is of both, with margins, mixtures, and two capsules on
# one body; steps of Runge and Kutta.
TANGLE = f"""
<mujoco>
  <option integrator="RK4" timestep="0.004"/>
  <default>
    <geom type="capsule" size="0.05" contype="1" conaffinity="1" condim="1" margin="0.01" gap="0.02"/>
    <joint type="hinge" axis="0 1 0" damping="0.1"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1" condim="3" margin="0.005"/>
    <body name="one" pos="0 0 0.5">{_ROOT}
      <geom name="one" fromto="0 0 0 0.2 0 0"/>
      <geom name="stub" fromto="0.1 0 0 0.1 0 0.1" size="0.02" solref="0.03 0.8"/>
      <body name="two" pos="0.2 0 0"><joint name="two"/>
        <geom name="two" fromto="0 0 0 0.15 0 0.05" size="0.04"/>
        <body name="three" pos="0.15 0 0.05"><joint name="three" limited="true" range="-140 140"/>
          <geom name="three" fromto="0 0 0 0.2 0 0" solmix="3" solimp="0.5 0.95 0.02 0.3 3"/>
          <body name="four" pos="0.2 0 0"><joint name="four" armature="0.01"/>
            <geom name="four" fromto="0 0 0 0.1 0 -0.1" solmix="2"/>
          </body>
        </body>
      </body>
      <body name="branch" pos="0 0 0.1"><joint name="branch" axis="0 -1 0"/>
        <geom name="branch" fromto="0 0 0 0.25 0 0.1" size="0.03"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="three" gear="3"/></actuator>
</mujoco>"""

# Nothing can touch the ground.
PENDULUM = """
<mujoco>
  <option timestep="0.02"/>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1" contype="2" conaffinity="0"/>
    <body name="pivot" pos="0 0 1">
      <joint name="x" type="slide" axis="1 0 0" stiffness="100"/>
      <joint name="z" type="slide" axis="0 0 1" stiffness="100"/>
      <joint name="turn" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body name="upper" pos="0 0 -0.5"><joint axis="0 1 0"/>
        <geom type="capsule" size="0.1" fromto="-0.2 0 0 0.2 0 0"/>
        <body name="lower" pos="0 0 -0.5"><joint axis="0 1 0"/><geom type="sphere" size="0.1"/></body>
      </body>
    </body>
  </worldbody>
</mujoco>"""


def states_near_the_ground(model: mujoco.MjModel, count: int, seed: int) -> States:
    """Any joint angles, heights about the reference position's, and controls that leave their ranges."""
    rng = np.random.default_rng(seed)
    qpos = model.qpos0 + rng.normal(size=(count, model.nq))
    qpos[:, 1] = model.qpos0[1] + rng.uniform(-0.6, 0.6, count)
    return States(qpos, 3 * rng.normal(size=(count, model.nv)), rng.normal(size=(count, model.nu)))
