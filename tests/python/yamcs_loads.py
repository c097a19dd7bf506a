"""Loads the XTCE dictionary into Yamcs, and flies `hzn fly` with a server of Yamcs.

1. The mission database of Yamcs loads the dictionary. It lists alarms and telecommands, encodes the telecommands, and
   decodes packets with random contents (`tests/yamcs/ListCommands.java`). Bytes and numbers must be those of hzn.
2. A server with the links of `book/reference/telemetry.md` sends all telecommands to `hzn fly`. Each must be completed or
   refused by its own acknowledgement, and telemetry must show what the flight software then says of itself.

Yamcs has the licence AGPL. It is a tool here, as a compiler is: it runs beside hzn, and nothing of hzn contains or links
it. The Python package `fprime-yamcs-bundle` has its jars.

Usage: yamcs_loads.py HZN EXAMPLE FOLDER. EXAMPLE writes packets with random contents and their numbers.
"""

import binascii
import contextlib
import json
import math
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

from fprime_yamcs_bundle import LIB_DIR
from telecommands import COMMANDS, MADE_BY_LOAD, MARKER, bytes_of_hzn, is_same, without_markers

ROOT = Path(__file__).resolve().parents[2]
JAVA = ["java", "-cp", f"{LIB_DIR}/*"]
# Values that are no alarm, as ranges or as labels with a level.
ALARMS = {
    "attitude_state": "warningRange(-inf,1.0]",
    "event_severity": "EnumerationAlarm(defaultLevel:NORMAL, alarmList: [(warning->WARNING), (error->CRITICAL)]",
    "housekeeping_mode": "EnumerationAlarm(defaultLevel:NORMAL, alarmList: [(safe->CRITICAL)]",
    "housekeeping_repairs": "warningRange(-inf,0.0]",
    "housekeeping_self_check": "criticalRange(-inf,0.0]",
    "housekeeping_watchdog_resets": "criticalRange(-inf,2.0]",
    "navigation_state": "warningRange(-inf,1.0]",
}
# Numbers of event_severity.
SEVERITIES = ["information", "warning", "error"]
# Seconds from 1958-01-01 to 1970-01-01, and from UTC to TAI since 2017.
UNIX_S, LEAP_S, SINCE_2017_S = 4383 * 86400, 37, (4383 + 17167) * 86400 + 37


def arguments_of(names: dict[str, list[str]], words: str, values: list) -> dict[str, str]:
    """Return the arguments of a telecommand by name; a value of None takes the initial value."""
    named = zip(names[words.split()[0]], values, strict=True)
    return {name: str(value) for name, value in named if value is not None}


def java_lists(dictionary: Path, commands: Path, packets: Path, folder: Path) -> list[str]:
    """Run the Java program, and return what it lists."""
    program = ROOT / "tests/yamcs/ListCommands.java"
    command = [*JAVA, str(program), *(str(path) for path in (dictionary, commands, packets, folder))]
    ran = subprocess.run(command, check=False, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    # The loader tells of what it does not understand, and the decoder of values that it cannot convert.
    bad = [line for line in ran.stderr.splitlines() if line.startswith(("WARNING", "SEVERE"))]
    assert not bad, "\n".join(bad)
    return ran.stdout.splitlines()


def names_of_arguments(listed: list[str]) -> dict[str, list[str]]:
    """Return the names of the arguments of each listed telecommand."""
    names: dict[str, list[str]] = {}
    for line in listed:
        first, *rest = line.split()
        if first == "command":
            names[rest[0]] = []
        elif first.endswith(":"):
            names[next(reversed(names))].append(first[:-1])
    return names


def check_listed(listed: list[str]) -> dict[str, list[str]]:
    """Check alarms, telecommands and verifiers; return the names of the arguments of each telecommand."""
    alarms = dict(line.split(" ", 2)[1:] for line in listed if line.startswith("alarm "))
    assert alarms == ALARMS, alarms
    names = names_of_arguments(listed)
    assert set(names) == {words.split()[0] for words in COMMANDS} | MADE_BY_LOAD, names
    for name in names:
        for answer in ("done", "refused"):
            assert f"  {answer} waits for {name}_{answer}, COMMAND_RELEASE[-1,10000]" in listed, (name, answer)
    return names


def check_commands(hzn: str, encoded: list[str], folder: Path) -> None:
    """Compare the packets that Yamcs makes with those of `hzn telecommand`, without their checksums."""
    for words, packet in zip(COMMANDS, encoded, strict=False):
        sent = bytes_of_hzn(hzn, words, folder / "command.bin")[:-2]
        assert bytes.fromhex(packet) == sent, (words, sent.hex(), packet)
    # `load` keeps several parameters in a packet, the dictionary one: the packet is that of `try` with another function.
    tried = bytes_of_hzn(hzn, "try threshold.level 90", folder / "command.bin")[:-2]
    staged, committed = (bytes.fromhex(packet) for packet in encoded[len(COMMANDS) :])
    assert staged == tried[:14] + bytes([9]) + tried[15:], staged.hex()
    assert committed == tried[:4] + bytes([0, 12]) + bytes(8) + bytes([10, 0, 5]), committed.hex()


def check_time(fields: dict[str, list[str]]) -> None:
    """Check the absolute time that Yamcs shows, where the leap seconds until now hold."""
    seconds, fraction = int(fields["time_seconds"][0]), int(fields["time_fraction"][0])
    if seconds >= SINCE_2017_S:
        stamp = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds - UNIX_S - LEAP_S))
        assert fields["time_seconds"][1] == f"{stamp}.000Z", fields["time_seconds"]
        assert fields["time_fraction"][1] == f"{stamp}.{fraction * 1000 >> 24:03}Z", fields["time_fraction"]


def check_values(decoded: list[str], lines: list[dict]) -> int:
    """Compare every number of every packet; return how many there are."""
    numbers = 0
    for text, line in zip(decoded, lines, strict=True):
        fields = {name: rest for name, *rest in (word.split("=") for word in text.split("\t")[1:])}
        assert int(fields["packet_apid"][0]) == line["apid"]
        check_time(fields)
        names = [name for name in fields if not name.startswith(("packet_", "time_"))]
        for name, written in zip(names, line["values"], strict=True):
            value = fields[name][0]
            assert is_same(float(value) if not value.isdecimal() else int(value), written), (name, value, written)
        if "event_severity" in fields:
            number, label = fields["event_severity"]
            assert label == SEVERITIES[int(number)], label
        numbers += len(names)
    return numbers


def check_database(hzn: str, example: str, dictionary: Path, folder: Path) -> dict[str, list[str]]:
    """Check the mission database; return the names of the arguments of each telecommand."""
    subprocess.run([example, folder], check=True)
    packets, apids = without_markers((folder / "packets.bin").read_bytes())
    (folder / "packets.ccsds").write_bytes(packets)
    lines = [json.loads(line) for line in (folder / "values.jsonl").read_text().splitlines()]
    assert apids == [line["apid"] for line in lines]
    commands = folder / "words.txt"
    # The names of the arguments come from the first listing.
    commands.write_text("ping\n")
    names = check_listed(java_lists(dictionary, commands, folder / "packets.ccsds", folder))
    made = [*COMMANDS.items(), ("stage", ["threshold.level", 90.0]), ("commit", [5])]
    rows = [[words.split()[0], *map("=".join, arguments_of(names, words, values).items())] for words, values in made]
    commands.write_text("".join("\t".join(row) + "\n" for row in rows))
    java_lists(dictionary, commands, folder / "packets.ccsds", folder)
    check_commands(hzn, (folder / "commands.txt").read_text().split(), folder)
    numbers = check_values((folder / "values.txt").read_text().splitlines(), lines)
    print(f"Yamcs: {len(made)} telecommands are those of hzn; {len(lines)} packets, {numbers} numbers equal")
    return names


SENSOR = """
[camera]
width = 320
height = 240
model = "pinhole"
fx_px = 300.0
fy_px = 300.0
cx_px = 159.5
cy_px = 119.5

[body]
kind = "earth"
altitude_km = 400.0
"""
SERVER = """
services:
  - class: org.yamcs.http.HttpServer
    args: {address: 127.0.0.1, port: %d}
instances: [hzn]
dataDir: data
secretKey: of a test
"""
INSTANCE = """
services:
  - class: org.yamcs.archive.XtceTmRecorder
  - class: org.yamcs.archive.CommandHistoryRecorder
  - class: org.yamcs.ProcessorCreatorService
    args: {name: realtime, type: realtime}
streamConfig:
  tm: [{name: tm_realtime, processor: realtime}]
  tc: [{name: tc_realtime, processor: realtime}]
  cmdHist: [cmdhist_realtime]
  event: [events_realtime]
  param: [pp_realtime]
  parameterAlarm: [alarms_realtime]
"""
PROCESSOR = """
realtime:
  services:
    - class: org.yamcs.StreamTmPacketProvider
    - class: org.yamcs.StreamTcCommandReleaser
  config:
    subscribeAll: true
    alarm: {parameterCheck: true}
"""
# These are refused: the mode is flight, and no pulse came.
REFUSED = {"process-once", "time"}


def free_port(kind: socket.SocketKind) -> int:
    """Return a port that nobody uses now."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def until(what: str, is_there: Callable[[], bool], limit_s: float = 60.0) -> None:
    """Wait until something holds."""
    end = time.monotonic() + limit_s
    while not is_there():
        assert time.monotonic() < end, f"{what}: not within {limit_s:.0f} s"
        time.sleep(0.1)


def is_listening(port: int) -> bool:
    """Return whether a program waits for connections at a port."""
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
        return True
    return False


class Relay:
    """Takes the telecommands of Yamcs, one a datagram, and writes them to the line with the sync marker."""

    def __init__(self, line_port: int, port: int) -> None:
        self.may_pass = threading.Event()
        self.may_pass.set()
        self.line = socket.create_connection(("127.0.0.1", line_port))
        self.datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.datagrams.bind(("127.0.0.1", port))
        threading.Thread(target=self.write, daemon=True).start()
        threading.Thread(target=self.drop_telemetry, daemon=True).start()

    def write(self) -> None:
        """Write telecommands; the checksum must be right already."""
        while True:
            packet = self.datagrams.recv(1024)
            self.may_pass.wait()
            assert binascii.crc_hqx(packet, 0xFFFF) == 0, packet.hex()
            self.line.sendall(MARKER + packet)

    def drop_telemetry(self) -> None:
        """Read what all connections get, so that the line does not fill."""
        while self.line.recv(65536):
            pass


class Server:
    """The interface of a server of Yamcs over HTTP."""

    def __init__(self, port: int) -> None:
        self.url = f"http://127.0.0.1:{port}/api"

    def ask(self, path: str, body: dict | None = None) -> dict:
        """Return the answer to a request."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, data=data, headers={"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            return json.load(answer)

    def is_up(self) -> bool:
        """Return whether the link of telemetry is connected."""
        with contextlib.suppress(OSError):
            return all(link["status"] == "OK" for link in self.ask("/links/hzn")["links"])
        return False

    def send(self, name: str, arguments: dict[str, str]) -> str:
        """Send a telecommand, and return its identifier."""
        return str(self.ask(f"/processors/hzn/realtime/commands/hzn/{name}", {"args": arguments})["id"])

    def end_of(self, identifier: str) -> str | None:
        """Return how a telecommand has ended: OK, or NOK, or None if it has not."""
        attributes = self.ask(f"/archive/hzn/commands/{identifier}").get("attr", [])
        return {item["name"]: item["value"].get("stringValue") for item in attributes}.get("CommandComplete_Status")

    def finish(self, name: str, identifier: str) -> str | None:
        """Wait for the end of a telecommand, and return it."""
        until(name, lambda: self.end_of(identifier) is not None, 12.0)
        return self.end_of(identifier)

    def parameter(self, name: str) -> dict:
        """Return the last value of a parameter."""
        return self.ask(f"/processors/hzn/realtime/parameters/hzn/{name}")

    def counter(self, name: str) -> int:
        """Return the last number of a counter."""
        return int(self.parameter(name)["rawValue"]["uint32Value"])


def links_of_the_book() -> str:
    """Return the configuration that the book gives for an instance."""
    blocks = (ROOT / "book/reference/telemetry.md").read_text().split("```yaml\n")[1:]
    return next(block.split("```")[0] for block in blocks if "type: xtce" in block)


@contextlib.contextmanager
def running(command: list, folder: Path, name: str) -> Iterator[subprocess.Popen]:
    """Run a program in a folder, with its words in a file."""
    with (folder / f"{name}.log").open("w") as log:
        process = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            process.terminate()
            process.wait(30)


def configure(dictionary: Path, folder: Path, line: int, relay: int, http: int) -> None:
    """Write the configuration of a server."""
    links = links_of_the_book()
    for written, own in (
        ("mdb/telemetry.xtce.xml", str(dictionary)),
        ("host: flight", "host: 127.0.0.1"),
        ("port: 5000", f"port: {line}"),
        ("port: 5001", f"port: {relay}"),
    ):
        assert written in links, written
        links = links.replace(written, own)
    (folder / "etc").mkdir()
    (folder / "etc/yamcs.yaml").write_text(SERVER % http)
    (folder / "etc/yamcs.hzn.yaml").write_text(links + INSTANCE)
    (folder / "etc/processor.yaml").write_text(PROCESSOR)


def check_answers(server: Server, relay: Relay, names: dict[str, list[str]]) -> int:
    """Send all telecommands; each must end as the flight software acknowledges it. Return the count in housekeeping."""
    ends = {}
    made = [*COMMANDS.items(), ("stage", ["threshold.level", 90.0]), ("commit", [1])]
    for words, values in made:
        name = words.split()[0]
        ends[name] = server.finish(words, server.send(name, arguments_of(names, words, values)))
    assert ends == {name: "NOK" if name in REFUSED else "OK" for name in names}, ends
    # An older acknowledgement of the same telecommand does not complete it.
    relay.may_pass.clear()
    identifier = server.send("ping", {})
    time.sleep(1.0)
    assert server.end_of(identifier) is None, "completed before its acknowledgement"
    relay.may_pass.set()
    assert server.finish("ping", identifier) == "OK"
    # `reset-counters` is the first that is counted after it.
    sent = list(ends)
    return sum(ends[name] == "OK" for name in sent[sent.index("reset-counters") :]) + 1


def check_telemetry(server: Server, carried_out: int) -> None:
    """Check what telemetry says after the telecommands, and its time after the clock was correlated."""
    tai = time.time() + UNIX_S + LEAP_S
    arguments = {"seconds": str(int(tai)), "fraction": str(int(math.modf(tai)[0] * 2**24))}
    arguments["moment"] = "arrival of the telecommand"
    assert server.finish("time", server.send("time", arguments)) == "OK"
    assert server.finish("report", server.send("report", {})) == "OK"
    until("housekeeping", lambda: server.counter("housekeeping_clock") == 1)
    # `time` was counted, too. `report` is counted after its packet, but the packet of every five seconds may follow.
    counted = server.counter("housekeeping_commands")
    assert carried_out + 1 <= counted <= carried_out + 2, (counted, carried_out)
    mode = server.parameter("housekeeping_mode")
    assert mode["engValue"]["stringValue"] == "flight", mode
    stamp = time.strptime(mode["generationTime"].split(".")[0], "%Y-%m-%dT%H:%M:%S")
    late_s = time.time() - (time.mktime(stamp) - time.timezone)
    assert 0.0 <= late_s < 10.0, late_s


def check_server(hzn: str, dictionary: Path, folder: Path, names: dict[str, list[str]]) -> None:
    """Fly with a server of Yamcs."""
    line, relay_port, http = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_STREAM)
    configure(dictionary, folder, line, relay_port, http)
    (folder / "sensor.toml").write_text(SENSOR)
    fly = [hzn, "fly", "-", "-s", "sensor.toml", "--line", f"tcp-listen:127.0.0.1:{line}", "--state", "state"]
    yamcs = [*JAVA, "org.yamcs.YamcsServer", "--etc-dir", "etc", "--data-dir", "data", "--no-color"]
    with running(fly, folder, "fly"):
        until("hzn fly", lambda: is_listening(line))
        relay = Relay(line, relay_port)
        with running(yamcs, folder, "yamcs"):
            server = Server(http)
            until("the server", server.is_up)
            check_telemetry(server, check_answers(server, relay, names))
    log = (folder / "yamcs.log").read_text()
    assert "SEVERE" not in log and "WARNING" not in log, log
    print(f"Yamcs: {len(names)} telecommands carried out or refused as hzn fly acknowledges them")


def main() -> None:
    """Load, encode and decode; then fly."""
    hzn, example, folder = str(Path(sys.argv[1]).resolve()), sys.argv[2], Path(sys.argv[3]).resolve()
    folder.mkdir(parents=True)
    dictionary = folder / "telemetry.xtce.xml"
    dictionary.write_bytes(subprocess.run([hzn, "telemetry", "--xtce"], check=True, capture_output=True).stdout)
    names = check_database(hzn, example, dictionary, folder)
    check_server(hzn, dictionary, folder, names)


main()
