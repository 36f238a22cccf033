"""Packets as other robots send them, and a robot that reads them."""

from __future__ import annotations

import numpy as np

from helpers import one_robot, rig_of
from swarmscope.onboard.sharing.feature_message import FeatureMessage
from swarmscope.onboard.sharing.inbox import ask, read_inbox, start_round
from swarmscope.onboard.sharing.message import (
    HEADER_FIELDS,
    LATENT_FEATURES,
    MAX_PACKET_BYTES,
    OK,
    Head,
    decode,
    encode_latent,
    encode_request,
    name_of,
)

RANGE_MAX = 5.0
ANGLES, DISTANCES = (0.5, 2.0, 4.0), (1.0, 2.0, 3.0)


def request(sender, seq, boot=0):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    return out[: encode_request(Head(sender, boot, seq, 0), out)].tobytes()


def features(sender, seq, reply_to, boot=0):
    return FeatureMessage(sender, boot, seq, reply_to, ANGLES, DISTANCES).pack(RANGE_MAX)


def latent(sender, seq, reply_to, boot=0):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    codes = np.arange(LATENT_FEATURES, dtype=np.uint8)
    return out[: encode_latent(Head(sender, boot, seq, reply_to), codes, 150, out)].tobytes()


def rows_of(now=10.0, boot=0, **options):
    rows = one_robot(rig_of(**options), address=1)
    rows.fill(now_s=now, boot=boot)
    return rows


def read(rows, *packets):
    rows.receive(list(packets))
    read_inbox(rows.view)
    return rows.shared


def dropped(row):
    return int(row["dropped_bad"]), int(row["dropped_stale"])


def asked(rows, *peers):
    start_round(rows.view)
    for peer in peers:
        ask(rows.view, peer)
    return name_of(int(rows.percept["boot"]), int(rows.shared["asked_seq"]))


def sent(row):
    """The outbox of a decision as [(to, bytes)]."""
    return [
        (int(row["out_to"][k]), row["out"][k, : row["out_length"][k]].tobytes()) for k in range(row["n_out"])
    ]


def header_of(packet):
    header = np.zeros(len(HEADER_FIELDS), np.int64)
    assert decode(np.frombuffer(packet, np.uint8).copy(), len(packet), header) == OK
    return header.tolist()
