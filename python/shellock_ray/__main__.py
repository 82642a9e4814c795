"""``python -m shellock_ray FOLDER --out OUT [--address auto] [--option size=150mm …]``"""

import argparse
import sys
from typing import Any, Dict, List

import shellock

from . import _checked, _jobs, run


def _options(words: List[str]) -> Dict[str, Any]:
    """By their names; what is given several times is a list."""
    flags = {option["name"] for option in shellock.options() if option["kind"] == "flag"}
    given: Dict[str, List[Any]] = {}
    for word in words:
        name, is_set, value = word.partition("=")
        name = name.replace("-", "_")
        is_bool = not is_set or name in flags and value in ("true", "false")
        given.setdefault(name, []).append(value != "false" if is_bool else value)
    return {name: values if len(values) > 1 else values[0] for name, values in given.items()}


def main() -> int:
    try:
        return _run()
    except shellock.ShellockError as e:
        print(f"error: {e}", file=sys.stderr)
        return e.code


def _run() -> int:
    parser = argparse.ArgumentParser(prog="python -m shellock_ray", description="Kits of a folder of models, by Ray")
    parser.add_argument("folder", help="folder of models, on this machine")
    parser.add_argument("--out", required=True, help="folder for the kits, or an address of an object store such as s3://bucket/kits")
    parser.add_argument("--address", default="local", help='the cluster: "auto" for the one that this machine is of; default: this machine alone')
    parser.add_argument("--cpus", type=int, default=1, help="cores for each kit")
    parser.add_argument("--patience", type=float, default=300, help="longest time for one, s")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="an option of `shellock build`; may be given several times")
    arguments = parser.parse_args()
    options = _options(arguments.option)
    # Before a cluster is asked for or started, which takes seconds.
    _checked(options, arguments.cpus, arguments.patience)
    _jobs(arguments.folder, None if "://" in arguments.out else arguments.out)
    try:
        import ray

        ray.init(address=arguments.address, log_to_driver=False, logging_level="warning")
    except (ImportError, ConnectionError) as e:
        raise shellock.InputError(f"Ray: {e}", 2) from None
    if hasattr(sys.stdout, "reconfigure"):
        # A name that the terminal cannot show must not end the run.
        sys.stdout.reconfigure(errors="replace")
    told = lambda record, number, of: print(f"{number}/{of} {record.line()}", flush=True)
    records = run(arguments.folder, arguments.out, options, cpus=arguments.cpus, patience=arguments.patience, told=told)
    verified = sum(r.status == "verified" for r in records)
    print(f"{verified} of {len(records)} models have a kit that passes every check")
    return 0 if records and verified == len(records) else 1


if __name__ == "__main__":
    sys.exit(main())
