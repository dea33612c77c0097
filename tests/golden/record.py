"""Record golden fingerprints: `python tests/golden/record.py [scene ...]`, all scenes by default.

Run it only after a change that is meant to move numbers, and state in the commit which scenes moved and why. Digests of
other processors are dropped for scenes whose projections moved, since they can no longer hold.
"""

import json
import sys

from fingerprint import STORE, digest, processor, projections, stored
from scenes import SCENES


def main(names: list[str]) -> None:
    """Record some scenes and print those that moved."""
    kept = {name: golden for name, golden in stored().items() if name in SCENES}
    for name in names or list(SCENES):
        output = SCENES[name](1)
        before, now = kept.get(name, {}), projections(output)
        same = before.get("projections") == now
        digests = {**(before.get("digests", {}) if same else {}), processor(): digest(output)}
        if before.get("digests", {}).get(processor()) != digests[processor()]:
            print(f"{name}: moved")
        kept[name] = {"projections": now, "digests": digests}
    STORE.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
