"""Engine cuda: the text of its kernels gives the words of scalar C, in any pieces; what is missing is told.

The kernels are run on a processor, thread after thread, behind the same calls that a GPU gets; where there is a GPU,
on it too. What NVRTC makes of them is looked at without a GPU.
"""

from __future__ import annotations

import ctypes
import dataclasses
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable, cuda
from casadi_gnc.campaigns.choosing import choose, seconds_on_cores, seconds_on_gpu
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.program import program_of
from casadi_gnc.errors import CampaignError, GpuError
from casadi_gnc.missions.parameters import vary
from casadi_gnc.system import assets, cuda_driver, nvrtc
from casadi_gnc.system.cuda_driver import OutOfMemoryError

#: Missions of every craft, mode and kind of allocation, with what NVRTC may make of them at most: bytes of a thread's
#: own memory, and of code. Beyond 170 kB of code an H100 waits for instructions, not for numbers.
FLOWN = {
    "huang2020/detumble": ("observer_pinv", 300, 48_000),
    "huang2020/slew": ("funnel_robust", 17_000, 350_000),
    "huang2019/wheel_faults": ("observers_pinv", 1_100, 105_000),
    "shi2020/docking": ("iobc", 600, 140_000),
    "sun2018/circular_orbit": ("tracking", 1_400, 150_000),
    "tao2019/case1": ("funnels", 2_800, 190_000),
}


def program(name, samples=60):
    mission = casadi_gnc.load(name)
    short = mission.with_timing(duration=samples * mission.timing.sample_period)
    return program_of(vary(short, ["initial.*"], FLOWN[name][0])), short


def cases(name, count, samples=60):
    made, _ = program(name, samples)
    mission = casadi_gnc.load(name)
    nominal = vary(mission, ["initial.*"], FLOWN[name][0]).parameters.nominal
    turns = np.sin(np.arange(count * len(nominal))).reshape(count, -1)
    return made, nominal * (1 + 0.01 * turns), np.arange(count, dtype=np.uint64) + 5


class Processor:
    """Do what `cuda_driver.Device` does, on this processor; its memory holds `room` bytes."""

    name, architecture, room = "processor", "sm_90", 2**40

    def __init__(self, number=0):
        self.held, self.launches, self.opened = {}, [], 0

    def open(self):
        self.opened += 1

    def close(self):
        assert not self.held

    def load(self, cubin):
        return ctypes.CDLL(cubin)

    def kernel(self, module, name):
        found = getattr(module, name.replace("gnc_", "launch_"))
        found.restype = None
        return found

    def take(self, size):
        if size + sum(map(len, self.held.values())) > self.room:
            raise OutOfMemoryError("the GPU has too little memory")
        block = (ctypes.c_char * size)()
        self.held[ctypes.addressof(block)] = block
        return ctypes.addressof(block)

    def give(self, address):
        del self.held[address]

    def send(self, array, address):
        ctypes.memmove(address, array.ctypes.data, array.nbytes)

    def fetch(self, array, address):
        ctypes.memmove(array.ctypes.data, address, array.nbytes)

    def launch(self, kernel, blocks, threads, columns, *more):
        self.launches.append((blocks, *(each.value for each in more)))
        kernel(ctypes.c_uint(blocks), ctypes.c_uint(threads), ctypes.byref(columns), *more)


def built(source, headers, options):
    """Return a library of device code for this processor, as `nvrtc.compiled` returns a cubin."""
    folder = built.folder / re.sub(r"\W", "_", options[-1] + str(len(source)))
    folder.mkdir(exist_ok=True)
    (folder / "kernel.cu").write_text(source)
    for name, text in headers.items():
        (folder / name).write_text(text)
    flags = [option for option in options if option.startswith("-D")]
    shim = Path(__file__).with_name("kernel_on_a_processor.cpp")
    command = ["g++", "-std=c++17", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-nostdinc", "-U__GNUC__", *flags]
    subprocess.run([*command, f"-I{folder}", str(shim), "-o", str(folder / "kernel.so")], check=True)
    return str(folder / "kernel.so")


@pytest.fixture
def processor(monkeypatch, tmp_path):
    monkeypatch.setattr(cuda, "Device", Processor)
    monkeypatch.setattr(cuda.nvrtc, "compiled", built)
    monkeypatch.setattr(built, "folder", tmp_path, raising=False)
    return Processor


@pytest.mark.tools("g++")
@pytest.mark.parametrize(
    "name", [name if i < 1 else pytest.param(name, marks=pytest.mark.slow) for i, name in enumerate(FLOWN)]
)
def test_the_text_of_the_kernels_has_the_words_of_scalar_c(name, processor):
    made, values, seeds = cases(name, 300)
    engine, flown = cuda.CudaBatch(made), []
    engine._step = 16
    alone = CompiledBatch(made, vectors="none").fly(values, seeds)
    found = engine.fly(values, seeds, flown.append)
    assert (found.words == alone.words).all()
    assert sum(flown) == 300
    stretches = [(first, count) for _, first, count in engine._device.launches[1:]]
    assert stretches[0] == (0, 16)
    assert len(stretches) > 1
    assert stretches[-1][0] + stretches[-1][1] == made.samples
    assert engine._device.launches[0] == (2,)  # blocks, the second not full
    engine.close()


@pytest.mark.tools("g++")
def test_where_memory_is_short_fewer_fly_at_once(processor, monkeypatch):
    made, values, seeds = cases("huang2020/detumble", 1000, samples=20)
    whole = cuda.CudaBatch(made).fly(values, seeds)
    monkeypatch.setattr(Processor, "room", 400_000)
    engine = cuda.CudaBatch(made)
    parts = engine.fly(values, seeds)
    assert (parts.words == whole.words).all()
    assert 256 <= engine._room < 1000
    monkeypatch.setattr(Processor, "room", 50_000)
    with pytest.raises(GpuError, match="too little memory"):
        cuda.CudaBatch(made).fly(values, seeds)


@pytest.mark.tools("g++")
def test_a_campaign_has_the_same_table(processor, monkeypatch, tmp_path):
    monkeypatch.setattr("casadi_gnc.campaigns.campaign._SHARD_SAMPLES", 60 * 16)
    _, mission = program("huang2020/detumble")
    rates = DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.05, 0.05])
    for engine in ("c", "cuda"):
        casadi_gnc.campaign(mission, 100, dispersions=[rates], out=tmp_path / engine, engine=engine)
    names = sorted(path.name for path in (tmp_path / "c").iterdir())
    assert len(names) > 10
    for name in names:
        assert (tmp_path / "c" / name).read_bytes() == (tmp_path / "cuda" / name).read_bytes()


def usage(log, kernel):
    """Return registers, and bytes of a thread's own memory with those of all it calls, of a kernel."""
    said = log[log.index(f"entry function '{kernel}'") :]
    registers = int(re.search(r"Used (\d+) registers", said)[1])
    own = re.search(r"(\d+) bytes cumulative stack size", said)
    return registers, int(own[1]) if own else 0


def code_size(cubin):
    """Return the bytes of instructions of an ELF file, less those of the kernel that begins."""
    assert cubin[:4] == b"\x7fELF"
    word = lambda at, size: int.from_bytes(cubin[at : at + size], "little")  # noqa: E731
    heads = [word(40, 8) + i * word(58, 2) for i in range(word(60, 2))]
    names = word(heads[word(62, 2)] + 24, 8)
    found = {}
    for head in heads:
        name = cubin[names + word(head, 4) :].split(b"\0", 1)[0].decode()
        found[name] = word(head + 32, 8) if name.startswith(".text.") else 0
    assert found[".text.gnc_begin"] > 0
    return sum(found.values()) - found[".text.gnc_begin"]


@pytest.mark.packages("nvidia.cu13")
@pytest.mark.parametrize(
    "name", [name if i < 1 else pytest.param(name, marks=pytest.mark.slow) for i, name in enumerate(FLOWN)]
)
def test_nvrtc_takes_the_text_and_the_code_stays_small(name):
    made, _ = program(name)
    _, memory, code = FLOWN[name]
    options = (*cuda.options(made, "sm_90"), "--ptxas-options=-v")
    cubin, log = nvrtc.translated(cuda.kernel_text(made), cuda.headers(), options)
    registers, own = usage(log, "gnc_go_on")
    assert registers > 128  # one block of 256 threads may take all; far fewer would spill
    assert own <= memory
    assert code_size(cubin) <= code
    ptx = nvrtc.translated(cuda.kernel_text(made), cuda.headers(), options, "PTX")[0] if not made.workspace else b""
    assert b"fma.rn.f64" not in ptx


@pytest.mark.packages("nvidia.cu13")
def test_a_cubin_is_the_same_bytes_twice_and_is_kept(cache):
    made, _ = program("huang2020/detumble")
    asked = (cuda.kernel_text(made), cuda.headers(), cuda.options(made, "sm_90"))
    first = nvrtc.translated(*asked)[0]
    assert nvrtc.translated(*asked)[0] == first
    assert nvrtc.compiled(*asked) == first
    (kept,) = [path for path in cache.glob("*.cubin") if path.read_bytes() == first]
    kept.write_bytes(first[:-1])
    assert nvrtc.compiled(*asked) == first


@pytest.mark.packages("nvidia.cu13")
def test_nvrtc_says_what_it_refuses():
    with pytest.raises(GpuError, match="NVRTC refused .*error: "):
        nvrtc.translated("nonsense;", {}, ("--gpu-architecture=sm_90",))
    with pytest.raises(GpuError, match="NVRTC refused"):
        nvrtc.translated("", {}, ("--gpu-architecture=sm_1",))


def test_what_is_missing_is_told_in_a_sentence(monkeypatch):
    made, _ = program("huang2020/detumble")
    cuda_driver.driver.cache_clear()
    monkeypatch.setattr(cuda_driver.ctypes, "CDLL", lambda name: (_ for _ in ()).throw(OSError(name)))
    with pytest.raises(GpuError, match="no NVIDIA driver is installed"):
        cuda.CudaBatch(made)

    class NoGpu:
        def cuInit(self, flags):
            return 100

    monkeypatch.setattr(cuda_driver.ctypes, "CDLL", lambda name: NoGpu())
    with pytest.raises(GpuError, match="finds no GPU"):
        cuda.CudaBatch(made)
    monkeypatch.undo()
    cuda_driver.driver.cache_clear()
    nvrtc.library.cache_clear()
    monkeypatch.setattr(cuda, "Device", Processor)
    monkeypatch.setattr(nvrtc, "_wheels", lambda name: [])
    with pytest.raises(GpuError, match=r'NVRTC is not installed; pip install "casadi-gnc\[cuda\]"'):
        cuda.CudaBatch(made)
    nvrtc.library.cache_clear()


def test_what_a_gpu_cannot_fly_is_refused():
    mission = casadi_gnc.load("huang2020/detumble").with_scheme("observer_pinv")
    with pytest.raises(CampaignError, match='no elementary functions of the C library; take maths="gnc"'):
        cuda.CudaBatch(program_of(vary(mission, ["initial.*"]), "libm"))
    from casadi_gnc.allocation.in_flight import SolverInFlight

    scheme = casadi_gnc.load("huang2020/slew").scheme("funnel_robust")
    outside = dataclasses.replace(scheme.actuation, allocator=SolverInFlight(scheme.actuation.allocator.problem))
    slew = casadi_gnc.load("huang2020/slew").with_scheme("funnel_robust", actuation=outside)
    rates = DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.05, 0.05])
    with pytest.raises(CampaignError, match="called from Python at every sample"):
        casadi_gnc.campaign(slew, 10, dispersions=[rates], engine="cuda")


def test_auto_takes_what_is_done_first_and_says_why(monkeypatch):
    made, _ = program("huang2020/detumble", 15000)
    lacking = GpuError("no NVIDIA driver is installed")
    monkeypatch.setattr(cuda, "present", lambda: (_ for _ in ()).throw(lacking))
    assert choose("auto", made, 10**5, threads=2).why.startswith("engine c: 2 cores take about ")
    assert choose("auto", made, 10**5, threads=2).why.endswith("; without a GPU: no NVIDIA driver is installed")
    assert "GPU" not in choose("auto", made, 1, threads=2).why  # all is done before it begins
    monkeypatch.setattr(cuda, "present", lambda: "NVIDIA H100")
    assert choose("auto", made, 10**5, threads=2).why.startswith("engine cuda: 2 cores take about ")
    assert choose("auto", made, 10**5, scheduler="tcp://there:8786").why.startswith("engine dask: its scheduler")
    assert choose("c", made, 10**5).why == "engine c, as asked"
    with pytest.raises(CampaignError, match="no engine 'gpu'; there is auto, c, cuda, dask, dask:cuda"):
        choose("gpu", made, 1)
    with pytest.raises(CampaignError, match="engine 'c' uses no scheduler"):
        choose("c", made, 1, scheduler="tcp://there:8786")


def test_estimates_are_of_the_measured_size():
    """16 cores with AVX-512 flew 1e5 de-tumbles in 8.5 s, an H100 in 0.21 s; they are even at 450 to 1000 flights."""
    made, _ = program("huang2020/detumble", 15000)
    assert 8.5 / 2 < seconds_on_cores(made, 10**5, "avx512", 16) < 2 * 8.5
    flying = seconds_on_gpu(made, 2 * 10**5) - seconds_on_gpu(made, 10**5)
    assert 0.21 / 2 < flying < 2 * 0.21


def has_gpu():
    try:
        cuda.present()
    except GpuError:
        return False
    return True


@pytest.mark.skipif(not has_gpu(), reason="needs an NVIDIA GPU with its driver, and the extra `cuda`")
@pytest.mark.parametrize("name", FLOWN)
def test_a_gpu_has_the_words_of_scalar_c(name):
    made, values, seeds = cases(name, 256, samples=500)
    alone = CompiledBatch(made, vectors="none").fly(values, seeds)
    assert (cuda.CudaBatch(made).fly(values, seeds).words == alone.words).all()


def test_the_headers_of_device_code_are_those_of_the_flight():
    runtime = assets.folder("codegen") / "runtime"
    assert cuda.headers()["gnc_math.h"] == (runtime / "gnc_math.h").read_text()
