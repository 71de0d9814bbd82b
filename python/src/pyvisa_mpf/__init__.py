# SPDX-License-Identifier: MIT
"""A backend of PyVISA: instruments behind the serial and GPIB servers of MPF.

    import pyvisa

    resources = pyvisa.ResourceManager("@mpf")
    voltmeter = resources.open_resource("MPF::voltmeter::INSTR")   # mpf-serial-server voltmeter
    print(voltmeter.query("VOLT?"))

Names of resources:

    MPF::voltmeter::INSTR      the instrument on the line of the serial server "voltmeter"
    MPF::GPIB0::22::INSTR      the instrument at address 22 of the GPIB server "GPIB0"
    MPF::GPIB0::5::2::INSTR    the same with a secondary address
    MPF3::voltmeter::INSTR     a server at location 3; without a number MPF_LOCATION, or 0
"""

from pyvisa_mpf.library import MpfVisaLibrary

WRAPPER_CLASS = MpfVisaLibrary

__all__ = ["WRAPPER_CLASS", "MpfVisaLibrary"]
