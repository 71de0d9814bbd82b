// SPDX-License-Identifier: MIT
// Steps: named places in the code at which a tool can stop, kill or count the program from outside.
//
//   MPF_STEP(slot_published);
//
// A step is one `nop` and an ELF note: a USDT probe (provider "mpf"). It executes no other
// instruction and needs no library. bpftrace, perf, gdb and SystemTap support these probes:
//
//   bpftrace -e 'usdt:./program:mpf:slot_published { @ = count(); }'
//
// `mpf torture` kills programs at the steps; docs/torture.md lists them all.
//
// Threads  any.
// Crash    steps exist to test crashes. The compiler may move plain stores past a step; a test that
//          needs every intermediate state steps through single instructions instead.
#pragma once

// The note has the format that <sys/sdt.h> writes (type 3 of owner "stapsdt"). Without `inline`,
// g++ estimates the statement as some sixty instructions and stops inlining the functions around
// it (docs/decisions/0010-steps.md).
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
