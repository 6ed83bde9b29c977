//! Every statement holds for the model, on the corners of the grid.

use smithwalk_validation::{Effort, Smithwalk, statement};

macro_rules! statements {
    ($($name:ident: $number:literal,)*) => {
        $(#[test]
        fn $name() {
            let found = statement(Smithwalk, Effort::Quick, $number).expect("a statement");
            let found = found.expect("figures");
            for check in &found.checks {
                println!("{check:?}");
            }
            assert!(found.passed(), "{:#?}", found.checks);
        })*
    };
}

statements! {
    nothing_is_in_the_way_as_often_as_masking_says: 1,
    nor_in_two_directions_at_once: 2,
    nor_after_one_bounce: 3,
    phase_functions_integrate_to_one: 4,
    phase_functions_are_reciprocal: 5,
    white_surfaces_keep_the_energy: 6,
    light_goes_both_ways: 7,
    walks_cut_after_one_bounce_are_single_scattering: 8,
    the_weak_white_furnace_is_white: 9,
    the_closed_form_is_met: 12,
    the_second_order_is_its_integral: 13,
}
