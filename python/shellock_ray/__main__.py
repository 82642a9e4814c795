"""``python -m shellock_ray FOLDER --out OUT [--address auto] [--option size=150mm …]``"""

import argparse
import sys
from typing import Any, Dict, List

from . import Record, run


def _options(words: List[str]) -> Dict[str, Any]:
    options: Dict[str, Any] = {}
    for word in words:
        name, is_set, value = word.partition("=")
        options[name.replace("-", "_")] = value if is_set else True
    return options


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m shellock_ray", description="Kits of a folder of models, by Ray")
    parser.add_argument("folder", help="folder of models, on this machine")
    parser.add_argument("--out", required=True, help="folder for the kits, or an address of an object store such as s3://bucket/kits")
    parser.add_argument("--address", default="local", help='the cluster: "auto" for the one that this machine is of; default: this machine alone')
    parser.add_argument("--cpus", type=int, default=1, help="cores for each kit")
    parser.add_argument("--patience", type=float, default=300, help="longest time for one, s")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="an option of `shellock build`; may be given several times")
    arguments = parser.parse_args()
    import ray

    ray.init(address=arguments.address, log_to_driver=False, logging_level="warning")
    told = lambda record, number, of: print(f"{number}/{of} {record.line()}", flush=True)
    records = run(arguments.folder, arguments.out, _options(arguments.option), cpus=arguments.cpus, patience=arguments.patience, told=told)
    verified = sum(r.status == "verified" for r in records)
    print(f"{verified} of {len(records)} models have a kit that passes every check")
    return 0 if records and verified == len(records) else 1


if __name__ == "__main__":
    sys.exit(main())
