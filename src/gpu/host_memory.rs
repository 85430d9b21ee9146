//! Returns memory to the system that the process has freed and the C library keeps. A driver that compiles on the CPU, as lavapipe does
//! with LLVM, uses some hundred MiB for the pipelines of a device. glibc keeps freed memory in arenas, each for several threads, and the
//! threads that compile for the next device may use another arena. Without this the process keeps each arena at its largest size. Measured
//! with lavapipe and two arenas: 290 MiB of heap, of which 47 to 147 MiB were in use; with one arena 186 MiB.

/// Returns freed memory to the system. This takes some milliseconds, in which no thread can allocate. Call it after a device was closed or
/// all pipelines were compiled. Does nothing if the C library is not glibc.
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: it has no arguments that could be wrong, locks what it changes, and may be called by any thread at any time.
        unsafe { malloc_trim(0) };
    }
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
unsafe extern "C" {
    /// Keeps `pad` bytes at the end of the heap. Returns 1 if anything was given back.
    fn malloc_trim(pad: usize) -> i32;
}

#[cfg(all(test, target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fs::File;
    use std::os::unix::fs::FileExt;

    const PAGE: usize = 4096;

    /// How many of these pages of the process are in memory. Other tests of the process do not matter to it.
    fn present(pages: &BTreeSet<usize>) -> usize {
        let map = File::open("/proc/self/pagemap").expect("pagemap");
        let is_present = |page: &&usize| {
            let mut entry = [0; 8];
            map.read_exact_at(&mut entry, 8 * **page as u64).expect("an entry");
            u64::from_ne_bytes(entry) >> 63 == 1
        };
        pages.iter().filter(is_present).count()
    }

    /// Small blocks between others that stay, as a compiler leaves them: the heap cannot shrink at its end.
    #[test]
    fn freed_memory_between_blocks_that_stay_is_given_back() {
        let mut blocks: Vec<Option<Vec<u8>>> = (0..32 << 10).map(|_| Some(vec![1; 1 << 10])).collect();
        let pages: BTreeSet<usize> = blocks.iter().flatten().map(|block| block.as_ptr().addr() / PAGE).collect();
        let full = present(&pages);
        for (n, block) in blocks.iter_mut().enumerate() {
            if n % 512 != 0 {
                *block = None;
            }
        }
        let kept = present(&pages);
        give_back();
        let left = present(&pages);
        assert!(kept > full / 2, "the C library keeps {kept} of {full} pages: the test proves nothing");
        assert!(left < full / 4, "{left} of {full} pages are left");
        assert!(blocks.iter().flatten().all(|block| block.iter().all(|byte| *byte == 1)));
    }
}
