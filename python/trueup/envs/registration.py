"""The ids of the environments, and how Gymnasium learns of them."""

from __future__ import annotations

import gymnasium

from .. import _trueup


def ids() -> dict[str, str]:
    """Ids of all environments, each with what has to be done in it."""
    return dict(_trueup.environments())


def register() -> None:
    """Make the environments known to Gymnasium, with their vector form; done when `trueup` is imported. To do it again changes nothing."""
    for identity in ids():
        if identity not in gymnasium.registry:
            gymnasium.register(
                identity,
                entry_point="trueup.envs.environment:Environment",
                vector_entry_point="trueup.envs.vector:VectorEnvironment",
                kwargs={"identity": identity},
                # An environment checks all that is asked of it by itself, steps out of turn among it; ``make(..., disable_env_checker=False)``
                # puts Gymnasium's checker around it all the same.
                order_enforce=False,
                disable_env_checker=True,
            )
