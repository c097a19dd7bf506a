"""Compares two tables of `hzn`, cell by cell and to the last digit.

    same_rows.py ONE.csv OTHER.csv

Times of processing and checksums, which cover these times, may differ. Exits with 1 at the first other difference.
"""

import csv
import sys

OWN = {"elapsed_us", "crc32"}


def load(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def main():
    one, other = map(load, sys.argv[1:])
    if not one or len(one) != len(other) or one[0].keys() != other[0].keys():
        raise SystemExit(f"same_rows: {len(one)} rows and {len(other)} rows, or other columns")
    names = [name for name in one[0] if name not in OWN]
    for a, b in zip(one, other):
        for name in names:
            if a[name] != b[name]:
                raise SystemExit(f"same_rows: {a.get('file')}: {name} is {a[name]} and {b[name]}")
    print(f"{len(one)} rows: each of {sum(bool(row[name]) for row in one for name in names)} cells has the same digits")


if __name__ == "__main__":
    main()
