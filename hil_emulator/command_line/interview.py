"""A command whose questions are also options."""

import click


class Interview(click.Command):
    """A command with an option for each question about a machine."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return its parameters; the questions are read only when they are needed."""
        from hil_emulator.machines.questions import QUESTIONS

        options = [click.Option([q.option], metavar="ANSWER", help=q.hint) for q in QUESTIONS]
        return [*self.params, *options, *super().get_params(ctx)[len(self.params) :]]
