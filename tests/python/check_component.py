"""Checks the component for F´ with the tools of F´, against stubs of its ports.

`fpp-check` reads the model. `fpp-to-cpp` makes the base class from it, whose methods must be those of the header that
stands for it when the sample is compiled without F´.

Usage: check_component.py FOLDER
"""

import re
import subprocess
import sys
from pathlib import Path

SAMPLE = Path(__file__).resolve().parents[2] / "firmware/hzn-c/samples/fprime"
MODEL = SAMPLE / "Components/HznSensor/HznSensor.fpp"
PORTS = SAMPLE / "stubs/Fw.fpp"
STUB = SAMPLE / "stubs/Components/HznSensor/HznSensorComponentAc.hpp"
# A method of the component with its types, such as `tlmWrite_Status(I32`.
METHOD = re.compile(r"\b(?:void|bool) (\w+_handler|\w+_out|isConnected_\w+|tlmWrite_\w+|log_[A-Z]\w+)\(([^)]*)\)")


def methods_of(header: Path) -> dict[str, list[str]]:
    """Return the declared methods that the component calls or defines, with the types of their arguments."""
    text = re.sub(r"//.*", "", header.read_text()).replace("Fw::Time()", "0")
    found = {}
    for name, arguments in METHOD.findall(text):
        arguments = [argument.strip().removeprefix("const ") for argument in arguments.split(",") if argument.strip()]
        types = [argument.split()[0] for argument in arguments]
        # Each value of telemetry may have a time, which the stub leaves out.
        found[name] = [kind.rstrip("&") for kind in types if kind != "Fw::Time"]
    return found


def main() -> None:
    """Check the model, and compare the methods."""
    tools, folder = Path(sys.executable).parent, Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([tools / "fpp-check", PORTS, MODEL], check=True)
    subprocess.run([tools / "fpp-to-cpp", "-d", folder, "-i", PORTS, "-p", SAMPLE, MODEL], check=True)
    made, stub = methods_of(folder / STUB.name), methods_of(STUB)
    called = set(re.findall(r"this->((?:tlmWrite|log|\w+Out)_\w+)\(", MODEL.with_suffix(".cpp").read_text()))
    made = {name: types for name, types in made.items() if name in called or name.endswith("_handler")}
    assert called <= set(made) and stub == made, (called, stub, made)
    print(f"fpp-check: the model is right; {len(made)} methods of the base class are those of the stub")


main()
