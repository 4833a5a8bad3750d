"""The Blender versions that references come from, and how to run a job list in one of them."""

import json
import os
import subprocess
import tempfile

SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "keying_reference.py")
VERSIONS = ("3.4.1", "4.2.0", "4.5.15")
PICTURES = ("key_image", "garbage_matte", "core_matte", "second_image")
GIVEN_ELSEWHERE = PICTURES + ("key_color",)
PROFILES = {"3.4.1": "blender-3.4", "4.2.0": "blender-4.2", "4.5.15": "blender-4.5"}


def add_arguments(parser):
    """One option a version: each is left alone unless its program is given."""
    parser.add_argument("--blender", metavar="PROGRAM", help="Blender 3.4.1, as Debian 12 packages it")
    parser.add_argument("--bpy42", metavar="PYTHON", help="a Python 3.11 that has bpy 4.2.0")
    parser.add_argument("--bpy45", metavar="PYTHON", help="a Python 3.11 that has bpy 4.5.15")


def chosen(args):
    """{version: command} of the versions that were asked for."""
    alone = ["-b", "--factory-startup", "--python-use-system-env", "-P", SCRIPT, "--"]
    commands = {"3.4.1": args.blender and [args.blender] + alone, "4.2.0": args.bpy42 and [args.bpy42, SCRIPT],
                "4.5.15": args.bpy45 and [args.bpy45, SCRIPT]}
    return {version: command for version, command in commands.items() if command}


def run(version, command, jobs):
    """Do all jobs in one session; returns what it printed, and insists on the version."""
    with tempfile.NamedTemporaryFile("w", suffix=".json", delete=False) as listing:
        json.dump(jobs, listing)
    done = subprocess.run(command + [listing.name], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    os.remove(listing.name)
    if done.returncode or "%d jobs done by Blender %s" % (len(jobs), version) not in done.stdout:
        raise SystemExit("%s\nBlender %s did not do its jobs" % (done.stdout[-4000:], version))
    return done.stdout
