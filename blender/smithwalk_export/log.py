"""What an export could not carry: collected, printed once each, summed up."""

import sys


class Log:
    """Warnings of one export, in order, without repetitions."""

    def __init__(self):
        self.warnings = []
        self.counts = {}
        self.path = None

    def warn(self, where, what):
        """Record that `what` of the item `where` (e.g. `material "Gold", node "Noise"`) was lost."""
        line = f"{where}: {what}"
        if line not in self.warnings:
            self.warnings.append(line)
            print(f"warning: {line}", file=sys.stderr)

    def count(self, kind, number):
        """Record how many items of a kind were written."""
        self.counts[kind] = number

    def summary(self):
        """One paragraph: what was written, where, and what was not carried."""
        written = ", ".join(f"{n} {kind}" for kind, n in self.counts.items())
        lines = [f"wrote {self.path}: {written}"]
        if self.warnings:
            lines.append(f"{len(self.warnings)} thing(s) not carried as in Blender:")
            lines += [f"  - {w}" for w in self.warnings]
        else:
            lines.append("everything was carried")
        return "\n".join(lines)
