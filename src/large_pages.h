#pragma once

namespace pellicle {

/// Lays the heap of this program in large pages of memory, where the kernel gives them to those who ask ("madvise" in
/// /sys/kernel/mm/transparent_hugepage/enabled, most systems' choice), and keeps what is freed for the next block. With
/// pages of 4 KiB a third of the set-up of a sheet of 1,000,000 springs is page faults. glibc does the same for
/// GLIBC_TUNABLES=glibc.malloc.hugetlb=1, which it reads before a program begins. Call it once, at the beginning.
void use_large_pages();

}  // namespace pellicle
