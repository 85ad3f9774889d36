"""From CasADi's tapes to C: the printer, controllers, packages, boards, and the machine they are compared with."""

from casadi_gnc.embedded import boards
from casadi_gnc.embedded.boards import Target
from casadi_gnc.embedded.controller import Controller, Options, Tunable
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.embedded.printer import print_function

__all__ = ["Controller", "HostPackage", "Machine", "Options", "Target", "Tunable", "boards", "print_function"]
