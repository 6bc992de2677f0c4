"""Questions about a machine: one table, from which prompts and options are derived."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from hil_emulator.config import datasheet, tables
from hil_emulator.config.table import QuantityReader
from hil_emulator.errors import UserError, brief
from hil_emulator.machines.valve_sheet import GIVEN, PRINTED, UNSTATED, ValveSheet, library
from hil_emulator.model.declare import Param
from hil_emulator.model.quantities import PARAMS
from hil_emulator.units import show

Answer = float | str


class Answers(dict[str, Answer]):
    """Answers by the name of their question.

    Args:
        values: answers.
        given: names of the user's answers; the other answers are usual values.

    """

    def __init__(self, values: Mapping[str, Answer], given: Iterable[str] = ()) -> None:
        super().__init__(values)
        self.given = set(given)


OWN = "own"
"""Name of a valve that is not in the library."""

IDEAL, FIXED, VARIABLE = "ideal", "fixed", "variable"
"""Supplies: constant pressure, a fixed pump with a relief valve, a pressure-compensated pump."""


def _always(answers: Answers) -> bool:
    return True


def _nothing(answers: Answers) -> str:
    return ""


@dataclass(frozen=True)
class Inquiry:
    """A question about a machine.

    Attributes:
        name: key of its answer; its option has dashes instead.
        text: the question.
        default: answer for a usual machine: a value, or a function of the previous answers.
        param: declaration of the answer, if it is a quantity.
        choices: possible answers, if it is a word.
        applies: whether the question is relevant, from the previous answers.
        asked: whether a relevant question is prompted; otherwise only its option answers it.
        wrong: error of the answers up to this question; "" without error.

    """

    name: str
    text: str
    default: Callable[[Answers], Answer] | Answer
    param: Param | None = None
    choices: tuple[str, ...] = ()
    applies: Callable[[Answers], bool] = _always
    asked: Callable[[Answers], bool] = _always
    wrong: Callable[[Answers], str] = _nothing

    def usual(self, answers: Answers) -> Answer:
        """Return the usual answer."""
        return self.default(answers) if callable(self.default) else self.default

    def written(self, answer: Answer) -> str:
        """Return an answer in the notation of a user."""
        if self.param is None or isinstance(answer, str):
            return str(answer)
        return show(answer, self.param.unit, self.param.shown)

    def read(self, text: str, before: Answers) -> Answer:
        """Return the answer that a text represents.

        Raises:
            ValueError: the text is not an answer; the message has the reason and an example.

        """
        given = QuantityReader(self.param)(text) if self.param else " ".join(text.split())
        if self.choices and given not in self.choices:
            choices = ", ".join(self.choices)
            raise ValueError(f"there is no {brief(text)!r}; there are {choices}")
        reason = self.wrong(Answers({**before, self.name: given}))
        if reason:
            raise ValueError(reason)
        return given

    @property
    def hint(self) -> str:
        """The question with an example of its answer, or with its choices."""
        if self.choices:
            return f"{self.text}: {', '.join(self.choices)}."
        return (
            f"{self.text}, such as {QuantityReader(self.param).example!r}."
            if self.param
            else (f"{self.text}.")
        )

    @property
    def option(self) -> str:
        """Its option on the command line."""
        return "--" + self.name.replace("_", "-")


def number(answers: Answers, name: str) -> float:
    """Return an answer that is a quantity, SI."""
    return float(answers[name])


def valve(answers: Answers) -> ValveSheet:
    """Return the data sheet of the valve, with the numbers that were answered."""
    chosen = str(answers["valve"])
    sheet = library().get(chosen) or ValveSheet("a valve of your own", "your data sheet", {}, {})
    for name in PRINTED:
        if name in answers:
            origin = GIVEN if name in answers.given else UNSTATED
            sheet = sheet.changed(name, number(answers, name), origin)
    return sheet


def _base(table: str, name: str) -> Param:
    return next(p for p in PARAMS[table] if p.name == name)


def _own_valve(answers: Answers) -> bool:
    return answers["valve"] == OWN


def _usual_rod(answers: Answers) -> float:
    """Return 0.7 bores in whole millimetres, of a bore below 10 mm in tenths of them."""
    bore = number(answers, "bore")
    return round(0.7 * bore, 3 if bore >= 0.01 else 4)


def _thick_rod(answers: Answers) -> str:
    bore, rod = number(answers, "bore"), number(answers, "rod")
    if rod < bore:
        return ""
    return f"the rod must be thinner than the bore, {show(bore, 'm', 'mm')}"


def _over_pressure(answers: Answers) -> str:
    sheet = valve(answers)
    limit = sheet.get("max_pressure", math.inf)
    if number(answers, "supply_pressure") <= limit:
        return ""
    return f"{sheet.title} takes at most {show(limit, 'Pa', 'bar')}; choose another valve, or less"


def _precharge_too_high(answers: Answers) -> str:
    if number(answers, "precharge") < number(answers, "supply_pressure"):
        return ""
    return "an accumulator works only where its pre-charge is below the supply pressure"


def weight(answers: Answers) -> float:
    """Return the weight of the load along the rod [N]."""
    if "slope" in answers:
        return datasheet.weight(number(answers, "mass"), number(answers, "slope"))
    return number(answers, "weight")


def _too_heavy(answers: Answers) -> str:
    pull = number(answers, "supply_pressure") * piston_area(answers)
    if abs(weight(answers)) < pull:
        return ""
    return f"the cylinder lifts no more than {show(pull, 'N', 'kN')}; take a larger bore"


def piston_area(answers: Answers) -> float:
    """Return the cap-side area [m²]."""
    return math.pi * number(answers, "bore") ** 2 / 4.0


def _pumped(answers: Answers) -> bool:
    return answers["pump"] != IDEAL


def _stored(answers: Answers) -> bool:
    return _pumped(answers) and number(answers, "accumulator") > 0.0


def _sheet_question(name: str, text: str) -> Inquiry:
    """Return the question for a number of the data sheet; prompted only for the user's valve."""
    param = PRINTED[name]
    return Inquiry(name, text, param.typical, param, asked=_own_valve)


WEIGHT = Param("weight", "N", "weight of the load along the rod", 0.0, -1e6, 1e6)
LINE = Param("line_length", "m", "length of the line from valve to cylinder", 0.3, 0.0, 50.0)
ACCUMULATOR = Param("accumulator", "m^3", "gas volume of the accumulator", 0.0, 0.0, 0.1, "l")
PRECHARGE = Param("precharge", "Pa", "of the accumulator, absolute", 100e5, 1e5, 700e5, "bar")
PUMP_FLOW = Param("pump_flow", "m^3/s", "largest flow of the pump", 1e-3, 1e-6, 0.1, "l/min")
NODE = Param("node_id", "1", "CANopen node-ID", 5.0, 1.0, 127.0)

QUESTIONS = (
    Inquiry("name", "Name of the machine", "my machine"),
    Inquiry("bore", "Bore of the cylinder", 0.04, tables.BORE),
    Inquiry("rod", "Diameter of its rod", _usual_rod, tables.ROD,
             wrong=_thick_rod),
    Inquiry("stroke", "Stroke", 0.3, _base("cylinder", "stroke")),
    Inquiry("valve", "Valve, from the library or your own", "moog_d633_40",
             choices=(*library(), OWN)),
    _sheet_question("nominal_flow", "Nominal flow on its data sheet"),
    Inquiry("pressure_drop_total", "Pressure drop at that flow, over both edges together", 70e5,
             tables.DROP_TOTAL, asked=_own_valve),
    Inquiry("pressure_drop_per_edge", "Pressure drop at that flow, over one edge", 35e5,
             tables.DROP_PER_EDGE, asked=lambda a: False),
    _sheet_question("rated_current", "Current of full opening"),
    _sheet_question("phase_90", "Frequency of -90° at a small amplitude"),
    Inquiry("amplitude_3db", "Frequency of -3 dB at a small amplitude", 100.0,
             PRINTED["amplitude_3db"], asked=lambda a: False),
    _sheet_question("step_time", "Time of a step from 0 to 100 %"),
    _sheet_question("overlap", "Overlap, half of the dead band"),
    Inquiry("port_b_flow", "Flow of the edges at port b over the nominal flow", 1.0,
             PRINTED["port_b_flow"], asked=lambda a: False),
    _sheet_question("hysteresis", "Hysteresis"),
    _sheet_question("threshold", "Threshold, or response sensitivity"),
    _sheet_question("null_leakage", "Leakage at null"),
    _sheet_question("leakage_pressure", "Pressure at which that is measured"),
    Inquiry("supply_pressure", "Supply pressure",
             lambda a: min(210e5, valve(a).get("max_pressure", math.inf)),
             _base("supply", "pressure"),
             wrong=_over_pressure),
    Inquiry("tank_pressure", "Return pressure", 1e5, _base("tank", "pressure")),
    Inquiry("pump", "Supply: constant pressure, a fixed pump or a pressure-compensated one",
             IDEAL, choices=(IDEAL, FIXED, VARIABLE)),
    Inquiry("pump_flow", "Flow of the pump", lambda a: 1.2 * valve(a).get("nominal_flow"),
             PUMP_FLOW, applies=_pumped),
    Inquiry("accumulator", "Gas volume of the accumulator, 0 without one", 0.0, ACCUMULATOR,
             applies=_pumped),
    Inquiry("precharge", "Its pre-charge pressure",
             lambda a: 0.8 * number(a, "supply_pressure"), PRECHARGE, applies=_stored,
             wrong=_precharge_too_high),
    Inquiry("line_length", "Length of each line from valve to cylinder", 0.3, LINE),
    Inquiry("mass", "Mass that the rod moves", 100.0, _base("load", "mass")),
    Inquiry("slope", "Angle of the rod over the horizontal, in place of the weight", 0.0,
             tables.SLOPE, asked=lambda a: False, wrong=_too_heavy),
    Inquiry("weight", "Its weight along the rod, positive against extension", 0.0, WEIGHT,
             applies=lambda a: "slope" not in a, wrong=_too_heavy),
    Inquiry("node_id", "CANopen node-ID", 5.0, NODE),
)  # fmt: skip
"""Every question, in the order of the prompts."""


def answered(given: Mapping[str, str], ask: Callable[[Inquiry, Answers], Answer]) -> Answers:
    """Return the answers to all relevant questions.

    Args:
        given: answers that are already available, by name.
        ask: prompts a question, and returns its answer.

    Raises:
        UserError: for a wrong answer, or an answer to a question that is not relevant.

    """
    answers = Answers({})
    for question in QUESTIONS:
        applies = question.applies(answers)
        if question.name in given and not applies:
            raise UserError(f"{question.option}: does not apply here, see {_governing(question)}")
        if question.name in given:
            answers[question.name] = _read(question, given[question.name], answers)
            answers.given.add(question.name)
        elif (
            applies and question.asked(answers) and not _answered_differently(question.name, given)
        ):
            usual = question.usual(answers)
            answers[question.name] = ask(question, answers)
            if answers[question.name] != usual:
                answers.given.add(question.name)
    return answers


def _read(question: Inquiry, text: str, answers: Answers) -> Answer:
    try:
        return question.read(text, answers)
    except ValueError as error:
        raise UserError(f"{question.option}: {error}") from None


def _governing(question: Inquiry) -> str:
    if question.name == "weight":
        return "--slope"
    return "--pump and --accumulator" if question.applies is _stored else "--pump"


def _answered_differently(name: str, given: Mapping[str, str]) -> bool:
    """Return whether another answer states the same quantity: drop per edge, other frequency."""
    pairs = {"pressure_drop_total": "pressure_drop_per_edge", "phase_90": "amplitude_3db"}
    return pairs.get(name) in given
