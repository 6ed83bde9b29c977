//! The report as text and as a page of HTML.

use super::{Check, OrderRow, Report};
use smithwalk_validation::orders::CAP_LOSS;
use std::fmt::Write;

/// A number with three significant digits.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-3..1e4).contains(&x.abs()) {
        format!("{x:.3}")
    } else {
        format!("{x:.2e}")
    }
}

fn verdict(passed: bool) -> &'static str {
    if passed { "holds" } else { "FAILS" }
}

/// What the bound of a check is: a p-value must be above it.
fn relation(check: &Check) -> &'static str {
    if check.statistic.starts_with('p') {
        "≥"
    } else {
        "≤"
    }
}

fn alarm(check: &Check) -> String {
    if check.false_alarm == 0.0 {
        "–".into()
    } else {
        format!("{:.0e}", check.false_alarm)
    }
}

fn check_text(check: &Check) -> String {
    format!(
        "      {:<5}  {} {} {} {}  ({} cases, false alarm {}; worst: {})\n             {}\n",
        verdict(check.passed),
        check.statistic,
        number(check.worst),
        relation(check),
        number(check.bound),
        check.cases,
        alarm(check),
        check.worst_case,
        check.subject,
    )
}

/// A table for a terminal.
pub fn text(report: &Report) -> String {
    let mut out = String::new();
    for s in &report.statements {
        let _ = writeln!(
            out,
            "{:>3}   {:<5}  {}\n             {}",
            s.number,
            verdict(s.passed()),
            s.title,
            s.equation
        );
        s.checks.iter().for_each(|c| out.push_str(&check_text(c)));
    }
    out.push_str("      single precision\n");
    out.push_str(&check_text(&report.precision));
    let _ = writeln!(
        out,
        "\nshare of light by scattering order, white GGX facets; cap: costs at most {} %",
        100.0 * CAP_LOSS
    );
    let _ = writeln!(
        out,
        "{:<15} {:>5} {:>5}  {:>7} {:>7} {:>7} {:>7} {:>7} {:>7}  {:>6} {:>4}",
        "facets", "α", "cosθ", "1", "2", "3", "4", "≥ 5", "> 10", "mean", "cap"
    );
    for row in &report.orders {
        let OrderRow {
            facets, alpha, cos, ..
        } = row;
        let _ = write!(out, "{facets:<15} {alpha:>5} {cos:>5} ");
        for share in row.shares.iter().chain([&row.tail, &row.beyond_ten]) {
            let _ = write!(out, " {share:>7.4}");
        }
        let _ = writeln!(out, "  {:>6.3} {:>4}", row.mean_order, row.cap);
    }
    let holding = report.statements.iter().filter(|s| s.passed()).count();
    let _ = writeln!(
        out,
        "\n{holding} of {} statements hold; {:.0} s",
        report.statements.len(),
        report.seconds
    );
    out
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// A row of cells.
fn row(out: &mut String, tag: &str, class: &str, cells: &[String]) {
    let _ = write!(out, "<tr class=\"{class}\">");
    for cell in cells {
        let _ = write!(out, "<{tag}>{}</{tag}>", escaped(cell));
    }
    out.push_str("</tr>\n");
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;\
padding:0 1rem;color:#222}table{border-collapse:collapse;width:100%;font-size:.85rem}\
td,th{text-align:left;padding:.25rem .6rem;border-bottom:1px solid #ddd;vertical-align:top}\
.no td{color:#b00020;font-weight:bold}code{background:#f4f4f4;padding:.1rem .3rem}\
svg{max-width:100%;height:auto}h2{margin-top:2.5rem}.number{font-variant-numeric:tabular-nums}";

fn checks(out: &mut String, checks: &[Check]) {
    out.push_str("<table>\n");
    let titles = [
        "compared",
        "worst",
        "bound",
        "cases",
        "false alarm",
        "worst case",
        "",
    ];
    row(out, "th", "", &titles.map(String::from));
    for c in checks {
        row(
            out,
            "td",
            if c.passed { "" } else { "no" },
            &[
                c.subject.clone(),
                format!("{} = {}", c.statistic, number(c.worst)),
                format!("{} {}", relation(c), number(c.bound)),
                c.cases.to_string(),
                alarm(c),
                c.worst_case.clone(),
                verdict(c.passed).into(),
            ],
        );
    }
    out.push_str("</table>\n");
}

/// The page.
pub fn html(report: &Report) -> String {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\
         <title>Validation of the microsurface model</title><style>{STYLE}</style></head><body>\n\
         <h1>Validation of the microsurface model</h1>\n\
         <p>What must hold for a Smith microsurface (Heitz, Hanika, d’Eon and Dachsbacher 2016), \
         tested in double precision. A bound on |z|, |t| or p holds for all cases of its check \
         together (Šidák); a false alarm is the chance that a correct model would pass it \
         somewhere. {} of {} statements hold. It took {:.0} s.</p>\n",
        report.statements.iter().filter(|s| s.passed()).count(),
        report.statements.len(),
        report.seconds
    );
    for s in &report.statements {
        let _ = write!(
            out,
            "<h2 id=\"s{}\">{}. {}</h2>\n<p><code>{}</code> – {}</p>\n",
            s.number,
            s.number,
            escaped(s.title),
            escaped(s.equation),
            verdict(s.passed())
        );
        checks(&mut out, &s.checks);
        s.figures.iter().for_each(|f| out.push_str(f));
    }
    out.push_str("<h2 id=\"lobes\">Lobes by scattering order</h2>\n");
    report.lobes.iter().for_each(|f| out.push_str(f));
    let _ = write!(
        out,
        "<h2 id=\"orders\">Share of light by scattering order</h2>\n<p>White facets, GGX. \
         The cap is the least highest order that costs no more than {} % of the light; \
         a share s has the standard error √(s(1 − s)/{}).</p>\n<table class=\"number\">\n",
        100.0 * CAP_LOSS,
        report.orders.first().map_or(0, |r| r.walks)
    );
    let titles = [
        "facets",
        "α",
        "cosθ",
        "1",
        "2",
        "3",
        "4",
        "≥ 5",
        "> 10",
        "mean order",
        "cap",
    ];
    row(&mut out, "th", "", &titles.map(String::from));
    for r in &report.orders {
        let mut cells = vec![r.facets.to_owned(), r.alpha.to_string(), r.cos.to_string()];
        let shares = r.shares.iter().chain([&r.tail, &r.beyond_ten]);
        cells.extend(shares.map(|s| format!("{s:.4}")));
        cells.extend([format!("{:.3}", r.mean_order), r.cap.to_string()]);
        row(&mut out, "td", "", &cells);
    }
    out.push_str("</table>\n<h2 id=\"precision\">Single against double precision</h2>\n");
    checks(&mut out, std::slice::from_ref(&report.precision));
    out.push_str("<p>Largest relative differences:</p>\n<table class=\"number\">\n");
    let titles = ["quantity", "distribution", "|f32/f64 − 1|", "at cosθ"];
    row(&mut out, "th", "", &titles.map(String::from));
    for r in &report.precision_table {
        let cells = [
            r.quantity.to_owned(),
            r.distribution.clone(),
            format!("{:.1e}", r.difference),
            r.cos.to_string(),
        ];
        row(&mut out, "td", "", &cells);
    }
    out.push_str("</table>\n</body></html>\n");
    out
}
