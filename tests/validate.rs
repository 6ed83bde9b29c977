//! `smithwalk validate` as users run it.

use std::process::Command;

use serde_json::Value;

#[test]
fn the_model_holds_and_the_report_says_so() {
    let directory = std::env::temp_dir().join(format!("smithwalk-validate-{}", std::process::id()));
    let output = Command::new(env!("CARGO_BIN_EXE_smithwalk"))
        .args(["validate", "--quick", "--json", "-o"])
        .arg(&directory)
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{log}");
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(printed["passed"], true);
    let statements = printed["report"]["statements"].as_array().unwrap();
    let numbers: Vec<_> = statements.iter().map(|s| s["number"].as_u64()).collect();
    assert_eq!(numbers, (1..=13).map(Some).collect::<Vec<_>>());
    for statement in statements {
        for check in statement["checks"].as_array().unwrap() {
            assert!(check["cases"].as_u64() > Some(0), "{check}");
            assert!(
                check["bound"].is_f64() && check["worst"].is_f64(),
                "{check}"
            );
        }
    }
    let saved = std::fs::read(directory.join("validate.json")).unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&saved).unwrap(), printed);
    // One file, with every figure in it and nothing to fetch.
    let page = std::fs::read_to_string(directory.join("validate.html")).unwrap();
    assert!(page.matches("<svg").count() >= 12);
    assert!(!page.contains("src=") && !page.contains("FAILS"));
    std::fs::remove_dir_all(&directory).unwrap();
}
