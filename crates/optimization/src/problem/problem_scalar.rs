//! Trait objects of functions that are generic over the scalar.
//!
//! A generic method cannot be called through a trait object. The library evaluates stored functions with a closed set of
//! scalars only: each trait object has one method for each of them, and [`ProblemScalar`] calls the right one.

use super::function::{Function, Functional, IntermediateMap, Point};
use autodiff::{Dual, HyperDual, PolynomialDegree, Scalar};

/// Number types with which stored functions can be evaluated: `f64`, [`Dual`], [`HyperDual`] and [`PolynomialDegree`].
pub trait ProblemScalar: Scalar {
    #[doc(hidden)]
    fn call(function: &dyn AnyFunction, point: &Point<Self>) -> Self;
    #[doc(hidden)]
    fn call_over(functional: &dyn AnyFunctional, history: &[Point<Self>]) -> Self;
    #[doc(hidden)]
    fn call_map(map: &dyn AnyMap, k: usize, design: &[Self]) -> Self;
}

macro_rules! numbers {
    ($($number:ty => $name:ident),*) => {
        /// Object-safe form of [`Function`]; implemented for every function.
        #[doc(hidden)]
        pub trait AnyFunction: Send + Sync {
            $(fn $name(&self, point: &Point<$number>) -> $number;)*
        }
        impl<F: Function> AnyFunction for F {
            $(fn $name(&self, point: &Point<$number>) -> $number { self.at(point) })*
        }
        /// Object-safe form of [`Functional`]; implemented for every functional.
        #[doc(hidden)]
        pub trait AnyFunctional: Send + Sync {
            $(fn $name(&self, history: &[Point<$number>]) -> $number;)*
            fn made_for(&self) -> Option<usize>;
        }
        impl<F: Functional> AnyFunctional for F {
            fn made_for(&self) -> Option<usize> { self.points() }
            $(fn $name(&self, history: &[Point<$number>]) -> $number { self.over(history) })*
        }
        /// Object-safe form of [`IntermediateMap`]; implemented for every map.
        #[doc(hidden)]
        pub trait AnyMap: Send + Sync {
            $(fn $name(&self, k: usize, design: &[$number]) -> $number;)*
        }
        impl<M: IntermediateMap> AnyMap for M {
            $(fn $name(&self, k: usize, design: &[$number]) -> $number { self.component(k, design) })*
        }
        $(impl ProblemScalar for $number {
            fn call(function: &dyn AnyFunction, point: &Point<Self>) -> Self { function.$name(point) }
            fn call_over(functional: &dyn AnyFunctional, history: &[Point<Self>]) -> Self { functional.$name(history) }
            fn call_map(map: &dyn AnyMap, k: usize, design: &[Self]) -> Self {
                map.$name(k, design)
            }
        })*
    };
}
numbers!(f64 => real, Dual => dual, HyperDual => hyper_dual, PolynomialDegree => degree);
