#!/usr/bin/env python3
"""tessera-farm with a Slurm of its own on this machine: slurmctld, slurmd and munged, which end with the test.

  slurm_test.py PROGRAM TESSERA_FARM

A job whose tasks are killed and requeued in mid-run makes the files of one process, byte for byte, and no frame twice; a
frame that cannot be made is said. Without Slurm what needs none is tested; exit code 77 then: skipped.
"""
import getpass
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM, FARM = (os.path.abspath(name) for name in sys.argv[1:3])
NEEDED = ["slurmctld", "slurmd", "munged", "sbatch", "squeue", "scontrol", "sinfo"]
PATH = os.pathsep.join([os.environ["PATH"], "/usr/sbin", "/sbin"])
MISSING = [name for name in NEEDED if shutil.which(name, path=PATH) is None]
FRAMES = 24


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Slurm:
    """A controller and a node."""

    def __init__(self, folder):
        self.folder, self.processes = pathlib.Path(folder), []
        self.folder.chmod(0o755)  # munge's clients must come to its socket
        host, user = socket.gethostname().split(".")[0], getpass.getuser()
        (self.folder / "munge.key").write_bytes(os.urandom(128))
        (self.folder / "munge.key").chmod(0o400)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        d = self.folder
        (d / "slurm.conf").write_text("\n".join([
            "ClusterName=tessera", f"SlurmctldHost={host}(127.0.0.1)", f"SlurmUser={user}", f"SlurmdUser={user}",
            "AuthType=auth/munge", f"AuthInfo=socket={d}/munge.socket,cred_expire=5", "CredType=cred/munge",
            f"StateSaveLocation={d}/state", f"SlurmdSpoolDir={d}/spool", f"SlurmctldPidFile={d}/slurmctld.pid",
            f"SlurmdPidFile={d}/slurmd.pid", f"SlurmctldPort={free_port()}", f"SlurmdPort={free_port()}",
            "ProctrackType=proctrack/linuxproc", "TaskPlugin=task/none", "SelectType=select/cons_tres",
            "SelectTypeParameters=CR_Core", "ReturnToService=2", "KillWait=2", "MpiDefault=none",
            "SchedulerParameters=sched_interval=2,batch_sched_delay=0",
            f"NodeName={host} NodeAddr=127.0.0.1 CPUs={min(2, os.cpu_count())} State=UNKNOWN",
            "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP", ""]))
        self.environment = {**os.environ, "SLURM_CONF": str(d / "slurm.conf"), "PATH": PATH}
        self.start("munged", "--foreground", "--force", f"--key-file={d}/munge.key", f"--socket={d}/munge.socket",
                   f"--pid-file={d}/munge.pid", f"--log-file={d}/munge.log", f"--seed-file={d}/munge.seed")
        self.until(lambda: (d / "munge.socket").exists(), "munged")
        self.start("slurmctld", "-D")
        self.start("slurmd", "-D")
        self.until(lambda: "idle" in self.run("sinfo", "-h", "-o", "%T").stdout, "an idle node")

    def start(self, *words):
        with open(self.folder / f"{words[0]}.out", "wb") as log:
            self.processes.append(subprocess.Popen(words, env=self.environment, stdout=log, stderr=log))

    def run(self, *words):
        return subprocess.run(words, env=self.environment, capture_output=True, text=True, check=False)

    def until(self, true, what, seconds=60):
        end = time.monotonic() + seconds
        while not true():
            if time.monotonic() > end:
                logs = "".join(f"\n{f.name}: {f.read_text(errors='replace')[-800:]}" for f in self.folder.glob("*.out"))
                raise AssertionError(f"no {what} in {seconds} s{logs}")
            time.sleep(0.2)

    def end(self):
        self.run("scancel", "-u", getpass.getuser())
        for process in reversed(self.processes):
            process.send_signal(signal.SIGTERM)
        for process in self.processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


class FarmTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(os.path.realpath(tempfile.mkdtemp(prefix="tessera-farm-")))
        self.environment = dict(os.environ)
        self.addCleanup(shutil.rmtree, self.folder, True)

    def tessera(self, *words):
        subprocess.run([PROGRAM, *words], cwd=self.folder, check=True)

    def farm(self, *words, **more):
        if words[0] == "slurm":
            words = ("slurm", "--program", PROGRAM, *words[1:])
        return subprocess.run([sys.executable, FARM, *words], cwd=self.folder, env=self.environment, capture_output=True,
                              text=True, check=False, **more)

    def make_inputs(self, size, frames=FRAMES):
        self.tessera("--frames", f"1-{frames}", "--pattern", "perlin:seed={FRAME_NUMBER}:octaves=3", size, "3", "-d", "half",
                     "-o", "in.#.exr")


class WordsTest(FarmTest):
    """What needs no Slurm."""

    def test_wrong_words(self):
        self.make_inputs("8x8", 3)
        for words, reason in [
            (["slurm"], "found no line"),
            (["slurm", "--", "--frames", "1-3", "in.#.exr", "--part", "1/2", "-o", "out.#.exr"], "--part"),
            (["slurm", "--", "--frames", "1-3", "in.#.exr", "--blurr", "3x3", "-o", "out.#.exr"], "--blurr"),
            (["slurm", "--", "in.#.exr", "-o", "out.exr"], "of several frames"),
            (["slurm", "--", "in.#.exr", "--mulc", "2", "-o", "in.#.exr"], "among what its frame reads"),
            (["slurm", "--tasks", "0", "--", "in.#.exr", "-o", "out.#.exr"], "from 1 to"),
            (["slurm", "--name", "a b", "--", "in.#.exr", "-o", "out.#.exr"], "a b"),
            (["follow", "nothing"], "found no job"),
        ]:
            result = self.farm(*words)
            self.assertEqual(result.returncode, 2, (words, result.stderr))
            self.assertIn(reason, result.stderr)
        self.assertFalse((self.folder / "tessera.farm").exists(), "nothing is left")

    def test_dry_run_writes_a_script_that_a_shell_runs(self):
        self.make_inputs("8x8", 5)
        result = self.farm("slurm", "--dry-run", "--tasks", "3", "--sbatch=--time=10", "--folder", "a job's folder", "--",
                           "--frames", "1-5", "in.#.exr", "--attrib", "Comment", "it's \"so\" $HOME", "-o", "out.#.exr")
        self.assertEqual(result.returncode, 0, result.stderr)
        script = (self.folder / "a job's folder" / "job.sh").read_text()
        self.assertIn("#SBATCH --time=10\n", script)
        for task in (1, 2, 3):
            subprocess.run(["sh", str(self.folder / "a job's folder" / "job.sh")], check=True, cwd="/",
                           env={**os.environ, "SLURM_ARRAY_TASK_ID": str(task)})
        self.assertEqual(len(list(self.folder.glob("out.*.exr"))), 5)
        told = subprocess.run([PROGRAM, "--info", "-v", "out.0002.exr"], cwd=self.folder, capture_output=True, text=True)
        self.assertIn("it's \"so\" $HOME", told.stdout.replace("\\\"", '"'))
        self.assertEqual(self.farm("slurm", "--dry-run", "--folder", "a job's folder", "--", "--frames", "1-5", "in.#.exr",
                                   "-o", "out.#.exr").returncode, 2, "a folder that is there")


@unittest.skipIf(MISSING, f"no {', '.join(MISSING)}")
class SlurmTest(FarmTest):
    def setUp(self):
        super().setUp()
        (self.folder / "slurm").mkdir()
        self.slurm = Slurm(self.folder / "slurm")
        self.environment = self.slurm.environment
        self.addCleanup(self.slurm.end)

    def records(self):
        return {f.name: f.read_text().splitlines() for f in self.folder.glob("out.frames.*.jsonl")}

    def process_of(self, task):
        """The number of the tessera that a task runs."""
        for entry in pathlib.Path("/proc").iterdir():
            try:
                if entry.name.isdigit() and os.readlink(entry / "cwd") == str(self.folder):
                    words = (entry / "cmdline").read_bytes().split(b"\0")
                    variables = (entry / "environ").read_bytes().split(b"\0")
                    if b"--resume" in words and f"SLURM_ARRAY_TASK_ID={task}".encode() in variables:
                        return int(entry.name)
            except OSError:
                pass
        return None

    def test_tasks_that_are_killed_and_requeued(self):
        self.make_inputs("900x700")
        line = ["--frames", f"1-{FRAMES}", "in.#.exr", "--median", "7x7", "--saturate", "1.2", "-o", "out.#.exr"]
        self.tessera(*line)
        outputs = [f"out.{k:04}.exr" for k in range(1, FRAMES + 1)]
        right = {}
        for name in outputs:
            right[name] = (self.folder / name).read_bytes()
            (self.folder / name).unlink()
        farm = subprocess.Popen([sys.executable, FARM, "slurm", "--program", PROGRAM, "--tasks", "3", "--interval", "0.5", "--name", "shot", "--",
                                 *line], cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                text=True)
        self.addCleanup(farm.kill)
        # The first is killed by the system as if it had taken too much; it comes again as one that failed.
        self.slurm.until(lambda: len(self.records().get("out.frames.1-of-3.jsonl", [])) >= 2, "records of task 1", 120)
        os.kill(self.process_of(1), signal.SIGKILL)
        # The second's node is wanted by somebody else.
        self.slurm.until(lambda: len(self.records().get("out.frames.2-of-3.jsonl", [])) >= 2, "records of task 2", 120)
        number = json.loads((self.folder / "shot.farm" / "job.json").read_text())["jobs"][0]
        requeued = self.slurm.run("scontrol", "requeue", f"{number}_2")
        self.assertEqual(requeued.returncode, 0, requeued.stderr)
        out, err = farm.communicate(timeout=400)
        print(err, end="")
        self.assertEqual(farm.returncode, 0, err)
        self.assertIn(f"all {FRAMES} frames are finished", out)
        for name in outputs:
            self.assertTrue((self.folder / name).read_bytes() == right[name], name)
        made = [json.loads(text)["frame"] for lines in self.records().values() for text in lines if text]
        self.assertEqual(sorted(made), list(range(1, FRAMES + 1)), "no frame was made twice")
        self.assertIn("once more", err)
        log = (self.folder / "shot.farm" / "task-2.log").read_text()
        self.assertTrue("REQUEUE" in log or (self.folder / "shot.farm" / "task-2.report.0").exists(), log)
        again = self.farm("follow", "shot.farm", "--interval", "0.5")
        self.assertEqual(again.returncode, 0, again.stderr)

    def test_frames_that_cannot_be_made_are_said(self):
        self.make_inputs("64x48", 6)
        (self.folder / "in.0004.exr").write_bytes(b"torn")
        result = self.farm("slurm", "--tasks", "2", "--retries", "0", "--interval", "0.5", "--", "--frames", "1-6", "in.#.exr",
                           "--mulc", "2", "-o", "out.#.exr", timeout=300)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("task 2: frames 4", result.stderr)
        self.assertIn("in.0004.exr", result.stderr)
        self.assertEqual(len(list(self.folder.glob("out.*.exr"))), 5, "the others are there")


if __name__ == "__main__":
    ended = unittest.main(argv=sys.argv[:1] + sys.argv[3:], exit=False, verbosity=2)
    if not ended.result.wasSuccessful():
        sys.exit(1)
    if MISSING:
        print(f"skipped: no {', '.join(MISSING)}; Debian's slurm-wlm and munge bring them")
        sys.exit(77)
