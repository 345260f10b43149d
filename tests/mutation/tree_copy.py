"""A copy of the working tree in which mutants are built, and what runs there without reaching anything else."""
import contextlib
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent.parent

# The room's libraries compiled file by file, without --together: a mutant then costs one object, not twelve
# sources. Other rooms' objects are ccache's.
APART = """function(palpate_apart folder)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "STATIC_LIBRARY")
      set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
    endif()
  endforeach()
  get_property(folders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(inner IN LISTS folders)
    palpate_apart(${inner})
  endforeach()
endfunction()
cmake_language(DEFER CALL palpate_apart ${CMAKE_SOURCE_DIR}/ROOM)
"""
SANDBOX = ["unshare", "--user", "--map-root-user", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc",
           "sh", "-c", 'mount --bind "$0" "$0" && mount -t tmpfs tmpfs /tmp && mount -o remount,bind,ro / &&'
           ' cd "$PWD" && exec "$@"']


class Failed(Exception):
    """Mutants cannot be tried here."""


class Copy:
    def __init__(self, folder, jobs, together):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.jobs, self.together = folder, jobs, together
        # Laid out like a working tree, so that ccache knows the objects of others with the same sources.
        self.source = (folder / "tree").resolve()  # may be a link
        self.build = self.source / ".build/release"
        self.environment = {"CCACHE_BASEDIR": str(self.source), "CCACHE_NOHASHDIR": "1", **os.environ, "GTEST_BRIEF": "1"}
        self.sandbox = SANDBOX + [str(folder)]
        if self.run(["true"], 20)[0] != 0:
            print("No sandbox here (unshare and mount are refused): mutants run unconfined.", file=sys.stderr)
            self.sandbox = []

    def update(self):
        """Brings the copy to the state of the repository's working tree; equal files keep their time."""
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                                cwd=REPOSITORY, check=True, capture_output=True).stdout.split(b"\0")
        wanted = {os.fsdecode(name) for name in listed if name and (REPOSITORY / os.fsdecode(name)).is_file()}
        for name in wanted:
            here, there = REPOSITORY / name, self.source / name
            if not there.exists() or here.read_bytes() != there.read_bytes():
                there.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(here, there)
                os.utime(there)
        for path in list(self.source.rglob("*")):
            name = str(path.relative_to(self.source))
            if path.is_file() and name not in wanted and not name.startswith(".build/"):
                path.unlink()

    def configure(self, room):
        (self.folder / "apart.cmake").write_text("" if self.together else APART.replace("ROOM", room))
        command = ["cmake", "--preset", "release", "-DPALPATE_TESTS=ON",
                   f"-DCMAKE_PROJECT_palpate_INCLUDE={self.folder / 'apart.cmake'}"]
        if shutil.which("ccache"):
            command.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
        if shutil.which("ld.lld"):
            command.append("-DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=lld")
        done = subprocess.run(command, cwd=self.source, capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed("The copy could not be configured:\n" + done.stderr)

    def make(self, targets):
        """Whether it could be built, and what was printed."""
        code, output = self.run(["ninja", "-C", self.build, "-j", str(self.jobs), *targets], None, confined=False)
        return code == 0, output

    def users(self, targets):
        """{source or header, from the tree's top: the objects of these targets that are made of it}; once they are built."""
        def listed(*words):
            return subprocess.run(["ninja", "-C", self.build, "-t", *words], capture_output=True, text=True).stdout.splitlines()
        wanted = {line for line in listed("inputs", *targets) if line.endswith(".o")}
        found, objects = {}, None
        for line in listed("deps"):
            if line[:1].strip():
                objects = line.split(": #deps")[0]
            elif line.strip() and objects in wanted:
                path = os.path.normpath(self.build / line.strip())
                found.setdefault(os.path.relpath(path, self.source), set()).add(objects)
        return found

    def run(self, command, limit, folder=None, confined=True):
        """(exit code, output); the code is None when the time was up."""
        def confine():
            resource.setrlimit(resource.RLIMIT_FSIZE, (2 ** 31, 2 ** 31))
            resource.setrlimit(resource.RLIMIT_DATA, (2 ** 33, 2 ** 33))
        sandbox = self.sandbox if confined else []
        process = subprocess.Popen(["nice", *sandbox, *map(str, command)], cwd=folder or self.folder,
                                   env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=confine if confined else None)
        try:
            output, _ = process.communicate(timeout=limit)
            return process.returncode, output.decode(errors="replace")
        except subprocess.TimeoutExpired:
            return None, ""
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
