"""The player of episodes, which several panels have."""

from nicegui.element import Element


class Player(Element, component="player.js"):
    """A canvas that plays an episode, or the controls of all of them."""
