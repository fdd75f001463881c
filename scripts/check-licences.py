#!/usr/bin/env python3
"""Reports dependencies whose licence expression has no alternative that `deny.toml` allows.

Covers all packages of the lock file: all features, all platforms, dependencies of tests and builds. This is the part of
`cargo deny check licenses` that needs no installation; Python 3.11 or later, standard library only.
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

TOKEN = re.compile(r"\s*([()]|[^\s()/]+|/)")


def is_allowed(expression: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression can be satisfied by allowed licences. The old `MIT/Apache-2.0` means OR."""
    tokens = ["OR" if token == "/" else token for token in TOKEN.findall(expression)]

    def alternatives() -> bool:
        result = conjunction()
        while tokens and tokens[0] == "OR":
            tokens.pop(0)
            # No `or`, which would skip tokens: all must be read.
            result |= conjunction()
        return result

    def conjunction() -> bool:
        result = licence()
        while tokens and tokens[0] == "AND":
            tokens.pop(0)
            result &= licence()
        return result

    def licence() -> bool:
        if not tokens or tokens[0] in (")", "OR", "AND", "WITH"):
            raise ValueError(f"not an SPDX expression: {expression}")
        name = tokens.pop(0)
        if name == "(":
            result = alternatives()
            if not tokens or tokens.pop(0) != ")":
                raise ValueError(f"not an SPDX expression: {expression}")
            return result
        if tokens[:1] == ["WITH"]:
            exception = " ".join(tokens[:2])
            del tokens[:2]
            name = f"{name} {exception}"
        return name in allowed

    result = alternatives()
    if tokens:
        raise ValueError(f"not an SPDX expression: {expression}")
    return result


def main() -> int:
    with open(ROOT / "deny.toml", "rb") as file:
        rules = tomllib.load(file)["licenses"]
    # {"crate": "name", "allow": [...]}: more licences for one crate.
    more = {exception["crate"]: set(exception["allow"]) for exception in rules.get("exceptions", [])}
    command = ["cargo", "metadata", "--format-version", "1", "--all-features", "--locked"]
    output = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    packages = json.loads(output)["packages"]
    refused = []
    for package in packages:
        name, expression = package["name"], package["license"]
        allowed = set(rules["allow"]) | more.get(name, set())
        try:
            if expression is None:
                refused.append(f"{name} {package['version']} names no SPDX licence")
            elif not is_allowed(expression, allowed):
                refused.append(f"{name} {package['version']}: {expression}")
        except ValueError as error:
            refused.append(f"{name} {package['version']}: {error}")
    if refused:
        print("licences that deny.toml does not allow:", *refused, sep="\n  ", file=sys.stderr)
        return 1
    print(f"licences of {len(packages)} packages are allowed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
