//! How the energy of white rough surfaces is spread over the scattering
//! orders: the table of `docs/orders.md`, in percent.
//!
//! ```text
//! cargo run --example orders
//! ```

use smithwalk_validation::{Effort, Smithwalk, orders};

fn main() {
    println!("| facets | α | cosθ | 1 | 2 | 3 | 4 | ≥ 5 | > 10 | mean order | cap |");
    println!("|{}", "---|".repeat(11));
    for row in orders::table(Smithwalk, Effort::Full) {
        let shares = row.shares.into_iter().chain([row.tail, row.beyond_ten]);
        let cells: String = shares
            .map(|share| format!(" {:.2} |", 100.0 * share))
            .collect();
        println!(
            "| {} | {} | {} |{cells} {:.3} | {} |",
            row.facets, row.alpha, row.cos, row.mean_order, row.cap
        );
    }
}
