# The processor starts at the beginning of the ROM. Constants stay there; variables begin as zeros.
    .section .start, "ax"
    .global _start
_start:
    la sp, _stack
    la t0, _zeros_begin
    la t1, _zeros_end
1:  bgeu t0, t1, 2f
    sw zero, 0(t0)
    addi t0, t0, 4
    j 1b
2:  call main
3:  j 3b
