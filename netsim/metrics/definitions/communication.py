"""Messages, frames, bytes, airtime, latency."""

from netsim.metrics.metric import grouped

METRICS = (
    *grouped(
        "messages",
        (
            "radio_messages",
            "1",
            "lower",
            "Messages that algorithms handed to their network layer, a broadcast counted once, whatever became of "
            "them.",
            "MessageSent",
        ),
        ("radio_messages_by_kind", "1", "lower", "The same by kind of message.", "MessageSent"),
        (
            "message_payload_byte",
            "byte",
            "lower",
            "Application payload of those messages, headers left out.",
            "MessageSent",
        ),
        ("message_payload_by_kind_byte", "byte", "lower", "The same by kind of message.", "MessageSent"),
        (
            "deliveries",
            "1",
            "",
            "Messages that reached an inbox whole; a broadcast counts once at each node that got it.",
            "MessageDelivered",
        ),
        (
            "unicasts_undelivered",
            "1",
            "lower",
            "Unicast messages sent, less those delivered; what was under way at the end of the run counts as "
            "undelivered.",
            "MessageSent, MessageDelivered",
        ),
        (
            "delivery_ratio_unicast",
            "1",
            "higher",
            "Unicast messages delivered over those sent; null when none was sent.",
            "MessageSent, MessageDelivered",
        ),
        (
            "drops_by_reason",
            "1",
            "lower",
            "By reason (`no_ack`, `channel_busy`, `queue_full`, `no_route`, ...): how often a node gave up a "
            "message or a fragment of one. After `no_ack` it may have arrived all the same.",
            "MessageDropped",
        ),
        (
            "latency_mean_s",
            "s",
            "lower",
            "Time from a message being handed over by its sender to its arrival in an inbox, mean over all "
            "deliveries; null without deliveries. Undelivered messages do not enter: look at the delivery ratio "
            "beside it.",
            "MessageDelivered",
        ),
        ("latency_max_s", "s", "lower", "The longest such time; null without deliveries.", "MessageDelivered"),
    ),
    *grouped(
        "frames",
        (
            "frames",
            "1",
            "lower",
            "Transmissions on the air: data, retries, acknowledgements, wake-up frames, control traffic.",
            "Frame",
        ),
        (
            "frames_data",
            "1",
            "lower",
            "First transmissions of a message, a fragment of one or a control packet (such as beacons), on each hop.",
            "Frame",
        ),
        (
            "frames_retry",
            "1",
            "lower",
            "Such frames sent again by the link layer for want of an acknowledgement.",
            "Frame",
        ),
        ("frames_ack", "1", "", "Acknowledgements of the link layer.", "Frame"),
        (
            "frames_strobe",
            "1",
            "lower",
            "Wake-up frames of low-power listening, which carry nothing of a message.",
            "Frame",
        ),
        (
            "frames_by_kind",
            "1",
            "lower",
            "By kind of the message carried, acknowledged or announced: all frames.",
            "Frame",
        ),
        (
            "frame_byte",
            "byte",
            "lower",
            "Bytes in all frames: physical-layer payload (PSDU), MAC header and checksum included; preambles left out.",
            "Frame",
        ),
        ("frame_by_kind_byte", "byte", "lower", "The same by kind of message.", "Frame"),
        (
            "airtime_s",
            "s",
            "lower",
            "Time on the air, preambles included, summed over all frames; frames that overlap count each.",
            "Frame",
        ),
        ("airtime_by_kind_s", "s", "lower", "The same by kind of message.", "Frame"),
        ("frames_unicast_data", "1", "", "Data frames and retries addressed to one node.", "Frame"),
        (
            "frame_reception_ratio_unicast",
            "1",
            "higher",
            "Share of these that their addressee received; null when there were none.",
            "Frame",
        ),
        (
            "frames_lost_by_reason",
            "1",
            "lower",
            "By what they were lost to at their addressee (`weak`, `collided`, `half_duplex`, `busy`, `asleep`, "
            "...; `out_of_reach` where the signal was too weak for the medium to decide about it): those not "
            "received.",
            "Frame",
        ),
    ),
)
