"""What an export could not carry as it is in Blender: collected, grouped, counted."""

import json
from dataclasses import dataclass

WRONG = "wrong"              # a placeholder, something missing: visible at a glance
APPROXIMATE = "approximate"  # close, but another picture than Cycles'
GENERAL = "general"          # true of every file; told once, in short
NOTE = "note"                # changes nothing in the picture: what was mended as Cycles treats it

_TITLES = {
    WRONG: "visibly wrong",
    APPROXIMATE: "approximate",
    GENERAL: "true of every export",
    NOTE: "mended as Cycles treats it, or left out without loss",
}


@dataclass(frozen=True)
class Warning:
    """One difference: its grade, the item it is about, and what differs."""

    grade: str
    where: str
    what: str

    def __str__(self):
        return f"{self.where}: {self.what}"


class Log:
    """The warnings of one export, without repetitions."""

    def __init__(self):
        self.entries = []
        self.counts = {}
        self.path = None
        self.options = []  # of `smithwalk render`: what Blender's settings ask for
        self._seen = set()

    def warn(self, where, what, grade=APPROXIMATE):
        """Record that `what` of the item `where` (e.g. `material "Gold", node "Noise"`) differs."""
        entry = Warning(grade, where, what)
        if (where, what) not in self._seen:
            self._seen.add((where, what))
            self.entries.append(entry)

    def wrong(self, where, what):
        """Something that is visibly wrong: a placeholder, a missing object or light."""
        self.warn(where, what, WRONG)

    def general(self, where, what):
        """Something that is true of every export."""
        self.warn(where, what, GENERAL)

    def note(self, where, what):
        """Something that was mended or left out and changes nothing in the picture."""
        self.warn(where, what, NOTE)

    def count(self, kind, number):
        """Record how many items of a kind were written."""
        self.counts[kind] = number

    def of(self, *grades):
        """The entries of these grades, in order."""
        return [e for e in self.entries if e.grade in grades]

    @property
    def warnings(self):
        """All lines: wrong first, then approximate, general, notes."""
        return [str(e) for grade in _TITLES for e in self.of(grade)]

    @property
    def strict_failure(self):
        """Whether anything is wrong or approximate."""
        return bool(self.of(WRONG, APPROXIMATE))

    def summary(self):
        """What was written and where, then the differences by grade, then how many."""
        written = ", ".join(f"{n} {kind}" for kind, n in self.counts.items())
        lines = [f"wrote {self.path}: {written}"]
        for grade, title in _TITLES.items():
            entries = self.of(grade)
            if entries:
                lines.append(f"{title}:")
                lines += [f"  - {e}" for e in entries]
        wrong, approximate = len(self.of(WRONG)), len(self.of(APPROXIMATE))
        if wrong or approximate:
            lines.append(f"{wrong + approximate} thing(s) not carried as in Blender: "
                         f"{wrong} visibly wrong, {approximate} approximate")
        else:
            lines.append("everything was carried")
        return "\n".join(lines)

    def json(self):
        """The same as JSON text."""
        return json.dumps({
            "scene": self.path,
            "written": self.counts,
            "wrong": len(self.of(WRONG)),
            "approximate": len(self.of(APPROXIMATE)),
            "warnings": [{"grade": e.grade, "where": e.where, "what": e.what}
                         for grade in _TITLES for e in self.of(grade)],
        }, indent=1, ensure_ascii=False) + "\n"
