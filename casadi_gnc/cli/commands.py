"""The commands under their headings, each with examples that a test parses."""

from __future__ import annotations

import typer

from casadi_gnc.cli import (
    allocate,
    attainable,
    bench,
    campaign,
    catalogue,
    check,
    demo,
    doctor,
    falsify,
    fly,
    generate,
    margins,
    new,
    problems,
    report,
    reproduce,
    schema,
    synthesize,
    tune,
    verify,
)
from casadi_gnc.cli.manners import Entry, Grouped, quietly

FLY, GAINS, FLIGHT_C = "Fly and check", "Allocate and synthesize", "Generate and verify C"
LOOK, BRING, MORE = "Look and compare", "Begin and bring your own", "More"

COMMANDS = (
    Entry(demo.demo, FLY, "Fly a shipped mission and write a page to look at.", ("demo", "demo --out first")),
    Entry(
        fly.fly,
        FLY,
        "Fly a mission; keep records and a summary, draw pictures.",
        (
            "fly huang2020/detumble --out out/detumble",
            "fly mission.toml --scheme observer_robust --figures figures --format pdf --report flight.html",
            "fly mc/ --case worst:settling_time --out worst/",
        ),
        is_about_a_file=True,
    ),
    Entry(
        campaign.campaign,
        FLY,
        "Fly thousands of dispersed cases; show what they say.",
        (
            "campaign mission.toml --flights 10000 --out mc/",
            "campaign show mc/ --figures mc/figures --report mc.html",
        ),
    ),
    Entry(
        falsify.falsify,
        FLY,
        "Look for the smallest dispersion that breaks a requirement.",
        ("falsify mission.toml --requirement ACS-012 --out broken.toml",),
        is_about_a_file=True,
    ),
    Entry(
        tune.tune,
        FLY,
        "Better gains, within the law's conditions and the checks.",
        (
            "tune huang2020/detumble --scheme observer_pinv --free rate_gain,observer_gain --out tuned.toml",
            "tune mission.toml --free attitude_gain=0.1:5 --against worst --out tuned.toml --report",
        ),
        is_about_a_file=True,
    ),
    Entry(
        check.check,
        FLY,
        "Tell what would go wrong, before the flight.",
        ("check huang2020/slew", "check mission.toml --figures figures --report"),
    ),
    Entry(
        margins.margins,
        FLY,
        "Gain, phase, delay and disk margins of every loop.",
        (
            "margins satellites/slew_and_track",
            "margins mission.toml --scheme pd --structured --figures figures --format svg",
        ),
        is_about_a_file=True,
    ),
    Entry(
        allocate.allocate,
        GAINS,
        "Commands in, certified forces out.",
        (
            "allocate huang2020/allocation --commands torques.csv --out forces.csv",
            "allocate huang2020/allocation --stream --json",
        ),
        is_about_a_file=True,
        gives_data=True,
    ),
    Entry(
        attainable.attainable,
        GAINS,
        "What the actuators can make, nominal and for every error.",
        ("attainable huang2020/allocation --figures figures",),
        is_about_a_file=True,
    ),
    Entry(
        synthesize.synthesize,
        GAINS,
        "Gains from matrix inequalities, certified from the data.",
        (
            "synthesize shi2020/synthesis",
            "synthesize gains.toml --backend clarabel --json",
            "synthesize gains.toml --into mission.toml --scheme pd",
        ),
    ),
    Entry(
        generate.generate,
        FLIGHT_C,
        "Write a controller, a function or an allocator as C.",
        (
            "generate huang2020/detumble --out flight/detumble --target cortex-m7",
            "generate filter.casadi --out fw/filter --real float32 --state x:x_next --rate 100",
            "generate huang2020/allocation --out fw/alloc --commands torques.csv",
        ),
        is_about_a_file=True,
    ),
    Entry(
        verify.verify,
        FLIGHT_C,
        "Compare a package's words here and on targets.",
        ("verify flight/detumble", "verify flight/detumble --target host,cortex-m7 --report words.html"),
    ),
    Entry(
        report.report,
        LOOK,
        "One HTML page of flights, checks, a campaign or a package.",
        ("report out/detumble --out detumble.html", "report huang2020/detumble --out checks.html"),
    ),
    Entry(
        reproduce.reproduce,
        LOOK,
        "Every printed number of a paper beside ours.",
        ("reproduce huang2020 --out claims",),
    ),
    Entry(
        new.new,
        BRING,
        "A commented start for a craft or a law of your own.",
        ("new craft SailCraft --folder mysat", "new law NadirPid --folder mysat"),
    ),
    Entry(
        catalogue.laws,
        BRING,
        "The laws: gains, units, and the crafts that each fits.",
        ("laws", "laws mission.toml --show attitude_pd"),
    ),
    Entry(
        catalogue.crafts,
        BRING,
        "The crafts: what they measure and make, the keys of their tables.",
        ("crafts --show satellite",),
    ),
    Entry(
        schema.schema,
        BRING,
        "The JSON Schema of problem files, for editors.",
        ("schema > problem.schema.json", "schema mission.toml", "schema --output fly"),
        gives_data=True,
    ),
    Entry(doctor.doctor, MORE, "What is installed, what is missing and what that costs.", ("doctor",)),
)

app = typer.Typer(
    name="casadi-gnc",
    help="Spacecraft guidance, navigation and control: from a problem file to flight C, with proof.",
    epilog="Begin with: casadi-gnc demo. Every command tells more with --help.",
    cls=Grouped,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for _entry in COMMANDS:
    _entry.add_to(app, "casadi-gnc")
for _part in (bench.app, problems.app):
    for _command in _part.registered_commands:
        if _command.callback is not None:
            _command.callback = quietly(_command.callback)
app.add_typer(bench.app, name="bench", rich_help_panel=LOOK)
app.add_typer(problems.app, name="problems", rich_help_panel=BRING)
