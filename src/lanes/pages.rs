//! Large pages of memory.
//!
//! Memory is handed out page by page when it is first written to. A page of 4 KiB costs more to get than to fill, and threads
//! wait for each other while it is got; Linux has pages of 2 MiB for those that ask.

/// Asks for large pages under `values`, before they are first written to. It is only a hint: nothing happens where there are
/// none, or where the array is smaller than one.
pub fn ask_for_large_pages<T>(values: &[T]) {
    #[cfg(target_os = "linux")]
    linux::ask(values.as_ptr().cast(), size_of_val(values));
    #[cfg(not(target_os = "linux"))]
    let _ = values;
}

/// Room for `len` elements, on large pages.
pub fn with_large_pages<T>(len: usize) -> Vec<T> {
    let mut room = Vec::with_capacity(len);
    ask_for_large_pages(room.spare_capacity_mut());
    room
}

/// `values`, whose number was not known beforehand, in as much room as they need, on large pages.
pub fn on_large_pages<T: Copy>(values: Vec<T>) -> Vec<T> {
    let mut list = with_large_pages(values.len());
    list.extend_from_slice(&values);
    list
}

#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "a system call that takes addresses")]
mod linux {
    use rustix::mm::{Advice, madvise};

    /// A large page, bytes.
    const LARGE: usize = 2 << 20;

    pub(super) fn ask(start: *const u8, bytes: usize) {
        if bytes < LARGE {
            return;
        }
        // Whole small pages: those at the ends too, so that the ranges of neighbouring arrays become one.
        let before = start.addr() % rustix::param::page_size();
        let first = start.wrapping_sub(before).cast_mut().cast();
        // SAFETY: this advice changes neither what the pages hold nor who may use them, only how large they are; ranges that
        // are not mapped are refused.
        let answer = unsafe { madvise(first, bytes + before, Advice::LinuxHugepage) };
        // Kernels without large pages say so.
        let _ = answer;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_as_before() {
        for len in [0, 1, 1 << 10, 3 << 20] {
            let mut list = vec![7u8; len];
            ask_for_large_pages(&list);
            assert!(list.iter().all(|&x| x == 7));
            list.fill(9);
            assert!(list.iter().all(|&x| x == 9));
            list[len / 2..].fill(5);
            let moved = on_large_pages(list.clone());
            assert_eq!((moved.capacity(), moved == list), (len, true));
        }
    }
}
