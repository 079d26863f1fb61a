"""The device side: multi-objective PPO for one agent, and for a population as one jitted call."""
