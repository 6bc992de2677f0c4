"""The groups of commands for the list of all, and an example of each command for its help."""

GROUPS = {
    "Run and connect": {
        "demo": "hil-emulator demo --picture demo.png",
        "run": "hil-emulator run hyq_knee --panel",
        "ctl": "hil-emulator ctl set supply_pressure '120 bar'",
        "panel": "hil-emulator panel run.rec",
        "replay": "hil-emulator replay run.rec",
        "plot": "hil-emulator plot run.rec position pressure_a",
        "convert": "hil-emulator convert run.rec run.csv run.blf",
    },
    "Describe your machine": {
        "init": "hil-emulator init my_machine.toml",
        "configs": "hil-emulator configs --copy hyq_knee",
        "check": "hil-emulator check hyq_knee spring_load",
        "effects": "hil-emulator effects hyq_knee",
        "linear": "hil-emulator linear hyq_knee --current '1 mA' --picture response.png",
        "characterise": "hil-emulator characterise all hyq_knee --out bench",
        "schema": "hil-emulator schema --out schema.json",
    },
    "Break and test": {
        "scenario": "hil-emulator scenario supply_drop_while_moving --html report.html",
        "faults": "hil-emulator faults",
        "conformance": "hil-emulator conformance --node 5 --eds device.eds --html report.html",
        "bench": "hil-emulator bench hyq_knee --duration '60 s'",
    },
    "Compare with measurements": {
        "gap": "hil-emulator gap hyq_knee log.csv",
        "identify": "hil-emulator identify hyq_knee one.csv two.csv --validate new.csv --out found",
        "experiment": "hil-emulator experiment micro_motion --amplitude '0.5 mm' --out micro.csv",
        "hide": "hil-emulator hide internal_leakage --size medium --out practice",
    },
    "Take elsewhere": {
        "export": "hil-emulator export hyq_knee --out network",
        "export-fmu": "hil-emulator export-fmu hyq_knee --out knee.fmu",
        "completion": 'eval "$(hil-emulator completion bash)"',
    },
}
"""A line for the shell, by the group and the name of the command."""

EXAMPLES = {name: line for group in GROUPS.values() for name, line in group.items()}
"""The lines by the name of the command."""
