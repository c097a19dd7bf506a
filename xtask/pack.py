"""Makes the files of `cargo xtask dist`, with the same bytes on every machine: times, owners and order are fixed.

    pack.py archive FOLDER FILE         FOLDER as FILE, a .tar.xz or .zip
    pack.py wheel WHEEL PROGRAM TEXT    WHEEL with the executable PROGRAM among its scripts, and TEXT among its licences
    pack.py deb FOLDER FILE             FOLDER, which has debian/control and the files below root/, as FILE (.deb)
    pack.py glibc FILE                  prints the newest GLIBC version that FILE or a program in a wheel needs
    pack.py sums FOLDER                 FOLDER/SHA256SUMS of all files in it
    pack.py check-sums FOLDER           fails if FOLDER/SHA256SUMS has not the checksum of each file in it

SOURCE_DATE_EPOCH is the time of all files.
"""

import base64
import gzip
import hashlib
import io
import os
import re
import stat
import sys
import tarfile
import time
import zipfile
from pathlib import Path

TIME = int(os.environ.get("SOURCE_DATE_EPOCH", "315532800"))


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def mode(path: Path) -> int:
    return 0o755 if path.stat().st_mode & stat.S_IXUSR else 0o644


def zipped(name: str, mode: int) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, time.gmtime(max(TIME, 315532800))[:6])
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system = 3  # Unix, so that the mode counts
    info.external_attr = (stat.S_IFREG | mode) << 16
    return info


def tar(folder: Path, prefix: str) -> bytes:
    """Return a .tar.xz of the files and folders in `folder`."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:xz", format=tarfile.GNU_FORMAT, preset=9) as archive:
        for path in sorted(folder.rglob("*")):
            info = tarfile.TarInfo(prefix + path.relative_to(folder).as_posix())
            info.mtime = TIME
            if path.is_dir():
                info.type, info.mode = tarfile.DIRTYPE, 0o755
                archive.addfile(info)
            else:
                info.size, info.mode = path.stat().st_size, mode(path)
                archive.addfile(info, io.BytesIO(path.read_bytes()))
    return out.getvalue()


def archive(folder: Path, out: Path) -> None:
    if out.suffix == ".zip":
        with zipfile.ZipFile(out, "w") as made:
            for path in files(folder):
                made.writestr(zipped(f"{folder.name}/{path.relative_to(folder).as_posix()}", mode(path)), path.read_bytes())
    else:
        out.write_bytes(tar(folder, folder.name + "/"))


def deb(folder: Path, out: Path) -> None:
    """Write a Debian package: an archive of `ar` with the format, the control files and the files."""
    root = folder / "root"
    for page in root.glob("usr/share/man/man*/*.[1-9]"):
        page.with_name(page.name + ".gz").write_bytes(gzip.compress(page.read_bytes(), mtime=0))
        page.unlink()
    sums = "".join(f"{hashlib.md5(p.read_bytes()).hexdigest()}  {p.relative_to(root).as_posix()}\n" for p in files(root))
    (folder / "debian/md5sums").write_text(sums)
    members = [
        ("debian-binary", b"2.0\n"),
        ("control.tar.xz", tar(folder / "debian", "./")),
        ("data.tar.xz", tar(root, "./")),
    ]
    with out.open("wb") as made:
        made.write(b"!<arch>\n")
        for name, data in members:
            made.write(f"{name:<16}{TIME:<12}{0:<6}{0:<6}{'100644':<8}{len(data):<10}`\n".encode())
            made.write(data + b"\n" * (len(data) % 2))


def wheel(path: Path, program: Path, text: Path) -> None:
    """Add the program to the scripts of a wheel, the text to its licences, and both to its RECORD."""
    name, version = path.name.split("-")[:2]
    added = [
        (f"{name}-{version}.dist-info/licenses/{text.name}", 0o644, text.read_bytes()),
        (f"{name}-{version}.data/scripts/{program.name}", 0o755, program.read_bytes()),
    ]
    places = {place for place, _, _ in added}
    with zipfile.ZipFile(path) as old:
        entries = [(info, old.read(info)) for info in old.infolist() if info.filename not in places]
    with zipfile.ZipFile(path, "w") as new:
        for info, contents in entries:
            if info.filename.endswith(".dist-info/RECORD"):
                record = (info.filename, contents.decode().splitlines())
                continue
            new.writestr(zipped(info.filename, (info.external_attr >> 16) & 0o777 or 0o644), contents)
        lines = []
        for place, mode, data in added:
            new.writestr(zipped(place, mode), data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            lines.append(f"{place},sha256={digest},{len(data)}")
        # RECORD is the last file, as the format of wheels recommends.
        lines += [line for line in record[1] if line.split(",")[0] not in places]
        new.writestr(zipped(record[0], 0o644), "\n".join([*lines, ""]).encode())


def glibc(path: Path) -> str:
    """Return the newest version of glibc whose symbols the file needs, or `none`."""
    if path.suffix == ".whl":
        with zipfile.ZipFile(path) as archive:
            contents = b"".join(archive.read(name) for name in archive.namelist())
    else:
        contents = path.read_bytes()
    versions = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"\0GLIBC_(\d+\.\d+(?:\.\d+)?)(?=\0)", contents)}
    return ".".join(map(str, max(versions))) if versions else "none"


def checksums(folder: Path) -> str:
    return "".join(
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder).as_posix()}\n"
        for path in files(folder)
        if path.name != "SHA256SUMS"
    )


def sums(folder: Path) -> None:
    (folder / "SHA256SUMS").write_text(checksums(folder))


def check_sums(folder: Path) -> None:
    told, found = ((folder / "SHA256SUMS").read_text(), checksums(folder))
    differ = sorted({line.split()[1] for line in set(told.splitlines()) ^ set(found.splitlines())})
    if differ:
        raise SystemExit(f"pack: SHA256SUMS is wrong about {', '.join(differ)}; `cargo xtask dist sums` writes it again")
    print(f"SHA256SUMS: {len(found.splitlines())} files")


def main() -> None:
    what, *paths = sys.argv[1:]
    paths = [Path(path) for path in paths]
    if what == "glibc":
        print(glibc(*paths))
    else:
        makers = {"archive": archive, "deb": deb, "wheel": wheel, "sums": sums, "check-sums": check_sums}
        makers[what](*paths)


if __name__ == "__main__":
    main()
