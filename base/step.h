// SPDX-License-Identifier: MIT
// Steps: names for places in the code, at which a program can be stopped, killed or counted from
// outside.
//
//   MPF_STEP(slot_published);
//
// A step is one `nop` and a note beside the program: a USDT probe (provider "mpf"). It runs no
// other instruction, and it needs no library.
//   bpftrace -e 'usdt:./program:mpf:slot_published { @ = count(); }'       perf, gdb and SystemTap
//   know them, too
// `mpf torture` kills programs at them; docs/torture.md lists all.
//
// Threads  any.
// Crash    what they are for. The compiler may move plain stores past a step: who needs each state
//          in between walks by instructions.
// Trust    -
#pragma once

// The note as <sys/sdt.h> writes it (type 3 of owner "stapsdt"). `inline`: else g++ takes it for
// some sixty instructions, and stops inlining the functions around it
// (docs/decisions/0010-steps.md).
#define MPF_STEP(name)                                                        \
  __asm__ __inline__ __volatile__(                                            \
      "990: nop\n"                                                            \
      ".pushsection .note.stapsdt,\"?\",\"note\"\n"                           \
      ".balign 4\n"                                                           \
      ".4byte 992f-991f, 994f-993f, 3\n"                                      \
      "991: .asciz \"stapsdt\"\n"                                             \
      "992: .balign 4\n"                                                      \
      "993: .8byte 990b, _.stapsdt.base, 0\n"                                 \
      ".asciz \"mpf\"\n"                                                      \
      ".asciz \"" #name                                                       \
      "\"\n"                                                                  \
      ".asciz \"\"\n"                                                         \
      "994: .balign 4\n"                                                      \
      ".popsection\n"                                                         \
      ".ifndef _.stapsdt.base\n"                                              \
      ".pushsection .stapsdt.base,\"aG\",\"progbits\",.stapsdt.base,comdat\n" \
      ".weak _.stapsdt.base\n"                                                \
      ".hidden _.stapsdt.base\n"                                              \
      "_.stapsdt.base: .space 1\n"                                            \
      ".size _.stapsdt.base, 1\n"                                             \
      ".popsection\n"                                                         \
      ".endif\n")
