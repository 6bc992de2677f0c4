"""A command that can be asked by options what it else asks for."""

import click


class Interview(click.Command):
    """A command with an option for each question about a machine."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return what it takes; the questions are read only where they are needed."""
        from hil_emulator.machines.questions import QUESTIONS

        told = [click.Option([q.option], metavar="ANSWER", help=q.hint) for q in QUESTIONS]
        return [*self.params, *told, *super().get_params(ctx)[len(self.params) :]]
