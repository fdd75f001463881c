//! Loops in the widest vector registers of the machine: the only file that uses pulp.
//!
//! The program is built for any machine of its architecture, so the compiler may use only registers
//! that all of them have (on x86-64, of two numbers). Here a loop is compiled several times, and
//! the variant for the machine is chosen at run time. Rust never fuses a product and a sum, so all
//! variants give the same bits.

/// A loop over plain slices of numbers that profits from wide registers.
pub trait Wide {
    /// The result.
    type Output;
    /// Runs the loop.
    ///
    /// This function and all that it calls must be `#[inline(always)]`, because other functions are
    /// compiled for the base architecture.
    fn run(self) -> Self::Output;
}

struct Adapter<W>(W);

impl<W: Wide> pulp::WithSimd for Adapter<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

/// Runs the loop with the widest available registers.
#[inline]
pub fn wide<W: Wide>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(Adapter(work))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sums<'a>(&'a [f64], &'a mut [f64]);

    impl Wide for Sums<'_> {
        type Output = ();

        #[inline(always)]
        fn run(self) {
            self.1.iter_mut().zip(self.0).for_each(|(sum, x)| *sum = *x * *x + 1.0 / *x);
        }
    }

    #[test]
    fn wide_registers_give_the_same_bits() {
        let numbers: Vec<f64> = (1..1000).map(|k| f64::from(k) / 7.0).collect();
        let (mut wide_sums, mut sums) = (vec![0.0; 999], vec![0.0; 999]);
        wide(Sums(&numbers, &mut wide_sums));
        Sums(&numbers, &mut sums).run();
        assert_eq!(wide_sums, sums);
    }
}
