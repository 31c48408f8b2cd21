"""What operations cost, as the benchmarks measured it: from their JSON, or from the table in the README."""
import json
import pathlib
import re

from blocks import Trouble

BEGIN, END = "<!-- bench:begin -->", "<!-- bench:end -->"


class Costs:
    """find(name, wanted): (columns, rows, note) or None."""

    def __init__(self, readme, files=()):
        self.groups, self.machine = {}, ""
        for file in files:
            self._load(pathlib.Path(file))
        text = pathlib.Path(readme).read_text()
        if BEGIN not in text or END not in text:
            raise Trouble(f"{readme}: the table between {BEGIN} and {END} is not there")
        block = text[text.index(BEGIN) + len(BEGIN):text.index(END)].strip()
        prose, _, table = block.partition("\n\n")
        self.note = " ".join(prose.split())
        rows = [[c.strip() for c in r.strip().strip("|").split("|")] for r in table.splitlines() if r.startswith("|")]
        self.columns, self.rows = rows[0], rows[2:]

    def _load(self, file):
        try:
            data = json.loads(file.read_text())
            items = data["benchmarks"]
        except (OSError, ValueError, KeyError) as error:
            raise Trouble(f"{file}: found no benchmark JSON ({error})") from error
        context = data.get("context", {})
        self.machine = ", ".join(str(context[k]) for k in ("host_name", "machine", "cpu", "date") if k in context) or (
            f"{context.get('num_cpus', '?')} processors at {context.get('mhz_per_cpu', '?')} MHz")
        for item in items:
            parts = item.get("run_name", item["name"]).split("/")
            if len(parts) < 6 or item.get("error_occurred") or "ns_per_pixel" not in item:
                continue
            if item.get("run_type") == "aggregate" and item.get("aggregate_name") != "median":
                continue
            self.groups.setdefault("/".join(parts[:2]), []).append((parts, item))

    def find(self, name, wanted):
        rows = []
        for key in [w for w in wanted if w in self.groups] + ["ops/" + name]:
            for parts, item in self.groups.get(key, []):
                error = item.get("max_error")
                rows.append([f"{parts[1]}, {parts[2]}, {parts[3]}, {parts[4].replace(':', ' ')}", parts[5],
                             f"{item['ns_per_pixel']:.2f}", "-" if error is None else f"{error:.1e}"])
        if rows:
            return (["what", "who", "ns per pixel", "max error"], rows,
                    f"Measured by the benchmarks on: {self.machine}.")
        for text in wanted:
            here = [r for r in self.rows if re.match(re.escape(text) + r"(,|$)", r[0])]
            if not here and "/" not in text:
                raise Trouble(f"lines.txt: {name}: no row of README's table begins with {text!r}")
            rows += here
        return (self.columns, rows, self.note) if rows else None
