"""The drawing of librcs/src in docs/architecture.md, and whether the sources keep to it."""

import re

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.M)
GROUND = "shared"  # headers that GLSL reads as well


class Drawing:
    """Levels of rooms, the uppermost first; what a room sees less of than all below it; where public headers belong."""

    def __init__(self, levels, sees, headers):
        self.level = {room: number for number, rooms in enumerate(levels) for room in rooms}
        self.sees = sees
        self.headers = headers

    def allows(self, room, other):
        if other == room:
            return True
        if room in self.sees and other not in self.sees[room]:
            return False
        return self.level[other] > self.level[room]


def blocks(text, kind):
    """The lines of the fenced blocks of this kind, comments (after two blanks and a #) taken off."""
    for block in re.findall(r"^```%s\n(.*?)^```$" % kind, text, re.M | re.S):
        for line in block.splitlines():
            line = line.split("  #")[0].strip()
            if line:
                yield line


def read_drawing(text):
    """```rooms: a level a line; "room: others" is all that it sees. ```headers: "room: public headers"."""
    levels, sees, headers = [], {}, {}
    for line in blocks(text, "rooms"):
        if ":" in line:
            room, others = line.split(":")
            sees[room.strip()] = set(others.split())
        else:
            levels.append(line.split())
    for line in blocks(text, "headers"):
        room, names = line.split(":")
        headers.update({name: room.strip() for name in names.split()})
    drawing = Drawing(levels, sees, headers)
    named = list(sees) + [o for others in sees.values() for o in others] + list(headers.values())
    for room in named:
        if room not in drawing.level:
            raise ValueError("the drawing has no room " + room)
    return drawing


def includes(path):
    return INCLUDE.findall(path.read_text())


def sources(folder):
    return sorted(p for p in folder.rglob("*") if p.suffix in (".h", ".cpp", ".in"))


def check_room(drawing, root, path):
    """What one source file of librcs/src includes that its room may not."""
    room = path.relative_to(root / "librcs" / "src").parts[0]
    where = path.relative_to(root)
    if room not in drawing.level:
        return ["%s: the drawing has no room %s" % (where, room)]
    faults = []
    for name in includes(path):
        first, _, header = name.partition("/")
        if first == "rcs":
            first = drawing.headers.get(header, room)
        elif not header or first not in drawing.level:
            continue
        if not drawing.allows(room, first):
            faults.append("%s: %s includes %s: the drawing has no such edge" % (where, room, name))
    return faults


def check_rooms(root):
    """Edges that the drawing does not have, rooms that it lacks and rooms that are not there."""
    drawing = read_drawing((root / "docs" / "architecture.md").read_text())
    faults = [fault for path in sources(root / "librcs" / "src") for fault in check_room(drawing, root, path)]
    there = {p.name for p in (root / "librcs" / "src").iterdir() if p.is_dir()}
    faults += ["docs/architecture.md: there is no room " + room for room in sorted(set(drawing.level) - there)]
    public = {p.name.removesuffix(".in") for p in sources(root / "librcs" / "include")}
    named = set(drawing.headers)
    faults += ["docs/architecture.md: there is no public header " + name for name in sorted(named - public)]
    return faults + ["docs/architecture.md: %s has no room" % name for name in sorted(public - named)]


def check_public_headers(root):
    """Public headers include each other alone, besides the standard library and GLM."""
    rooms = {p.name for p in (root / "librcs" / "src").iterdir() if p.is_dir()} | {GROUND}
    faults = []
    for path in sources(root / "librcs" / "include"):
        for name in includes(path):
            if name.split("/")[0] in rooms:
                faults.append("%s: a public header includes the private %s" % (path.relative_to(root), name))
    return faults


def check_service(root):
    """The service sees of librcs its public headers alone."""
    rooms = {p.name for p in (root / "librcs" / "src").iterdir() if p.is_dir()} | {GROUND}
    faults = []
    for path in sources(root / "service"):
        for name in includes(path):
            own = (root / "service" / name).exists() or (path.parent / name).exists()
            if not own and (name.split("/")[0] in rooms or "librcs" in name):
                faults.append("%s: the service includes the private %s" % (path.relative_to(root), name))
    return faults
