"""Information flow by round: how many vertices send, and how often one wakes (Chen et al. 2006, Figs. 10 and 13)."""

from typing import Any

from netsim.flow.rounds import RoundLog


class Waking(RoundLog):
    """Senders of each round, and vertices that send again after a round or more of silence."""

    def figures(self) -> dict[str, Any]:
        """The metrics; empty where nothing was sent or rounds are not the same instant on all nodes."""
        rounds = self.rounds()
        if not rounds or not self.is_synchronous:
            return {}
        return {
            "senders_by_round": [len(each.senders) for each in rounds],
            "vertices_woken": sum(len(each.woken) for each in rounds),
        }
