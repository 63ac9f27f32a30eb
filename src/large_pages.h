#pragma once

namespace pellicle {

/// Puts the heap of this program in large pages of memory, if the kernel gives them on request ("madvise" in
/// /sys/kernel/mm/transparent_hugepage/enabled, most systems' setting), and keeps freed memory for later blocks. With
/// pages of 4 KiB a third of the set-up of a sheet of 1,000,000 springs is page faults. glibc does the same for
/// GLIBC_TUNABLES=glibc.malloc.hugetlb=1, which it reads before a program begins. Call it once, at the beginning.
void use_large_pages();

}  // namespace pellicle
