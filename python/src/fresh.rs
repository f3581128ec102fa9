//! Arrays that are given away: one that nobody holds any more is filled again.
//!
//! To make an array of NumPy and to let it go takes longer than many a step. Whoever looks at what was observed and goes on has let go
//! of it by the step after the next, so two arrays in turns do; whoever keeps what was observed keeps it, and gets others.

use numpy::npyffi::{_PyArray_GET_ITEM_DATA, NPY_ARRAY_WRITEABLE};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// The two arrays that were given away last.
#[derive(Default)]
pub struct Fresh {
    arrays: [Option<Py<PyArray1<f32>>>; 2],
    turn: usize,
}

impl Fresh {
    /// An array with these numbers that is the caller's alone.
    #[inline]
    pub fn with<'py>(&mut self, py: Python<'py>, numbers: &[f32]) -> Bound<'py, PyArray1<f32>> {
        self.turn ^= 1;
        let place = &mut self.arrays[self.turn];
        if let Some(array) = place.as_ref().map(|array| array.bind(py))
            && nobody_holds(array)
            && filled(array, numbers)
        {
            return array.clone();
        }
        let array = PyArray1::from_slice(py, numbers);
        *place = Some(array.clone().unbind());
        array
    }
}

/// Whether an array is held here alone: by no variable, view, buffer or weak reference.
#[inline]
#[allow(unsafe_code)]
fn nobody_holds(array: &Bound<'_, PyArray1<f32>>) -> bool {
    // SAFETY: the pointers are of an array that is alive, and read under Python's lock.
    unsafe {
        let fields = _PyArray_GET_ITEM_DATA(array.as_array_ptr().cast_const());
        pyo3::ffi::Py_REFCNT(array.as_ptr()) == 1 && (*fields).weakreflist.is_null()
    }
}

/// Writes into an array that nobody else holds, if it is as it was made: whoever held it may have given it another shape, or its bytes
/// another meaning, may have locked it, or, with an older NumPy, put it on the memory of another.
#[inline]
#[allow(unsafe_code)]
fn filled(array: &Bound<'_, PyArray1<f32>>, numbers: &[f32]) -> bool {
    // SAFETY: as above.
    let (base, flags) = unsafe {
        let fields = _PyArray_GET_ITEM_DATA(array.as_array_ptr().cast_const());
        ((*fields).base, (*fields).flags)
    };
    let own = base.is_null() && flags & NPY_ARRAY_WRITEABLE != 0;
    if !own || !array.as_any().is_exact_instance_of::<PyArray1<f32>>() {
        return false;
    }
    // SAFETY: nobody else has it, so nobody reads or writes it meanwhile.
    match unsafe { array.as_slice_mut() } {
        Ok(own) if own.len() == numbers.len() => {
            own.copy_from_slice(numbers);
            true
        }
        _ => false,
    }
}
