//! Scene files: what they say, or what is said about them.

use super::assert_none;
use smithwalk::description::Description;

/// How many samples a scene asks for, or what is said of it.
type Becomes = Result<u32, &'static str>;

fn check(cases: &[(&str, &str, Becomes)]) {
    let mut faults = Vec::new();
    for (what, text, becomes) in cases {
        let found = match (Description::from_str(text, "s.yaml", &[]), becomes) {
            (Ok(description), Ok(spp)) if description.sampling.spp == *spp => continue,
            (Ok(description), _) => format!("{} samples", description.sampling.spp),
            (Err(problems), Err(message)) if problems.to_string().contains(message) && problems.to_string().len() < 4000 => {
                continue;
            }
            (Err(problems), _) => problems.to_string(),
        };
        faults.push(format!("{what}: {found}"));
    }
    assert_none(&faults);
}

#[test]
fn blanks_and_layouts() {
    check(&[
        ("a tab behind a colon", "smithwalk: 1\nsampling:\n  spp:\t16\n  max_bounces:\t2\n", Ok(16)),
        ("tabs behind every colon", "smithwalk:\t1\nsampling:\t\n  spp:\t\t16\n", Ok(16)),
        ("a tab before a word", "smithwalk: 1\nsampling: {spp: 16, estimator:\twalk}\n", Ok(16)),
        ("a tab before a minus", "smithwalk: 1\nsampling: {spp: 16}\nfilm: {exposure:\t-1}\n", Ok(16)),
        ("a tab before a mapping", "smithwalk: 1\nsampling:\t{spp: 16}\n", Ok(16)),
        ("a tab before a comment", "smithwalk: 1\nsampling: {spp: 16}\t# few\n", Ok(16)),
        ("a tab behind a dash", "smithwalk: 1\nsampling: {spp: 16}\nobjects:\n-\tmesh: a\nmeshes: {a: {file: a.obj}}\n", Ok(16)),
        ("cJSON's tabs", "{\n\t\"smithwalk\":\t1,\n\t\"sampling\":\t{\n\t\t\"spp\":\t16\n\t}\n}", Ok(16)),
        ("a tab in a name stays", "smithwalk: 1\nsampling: {spp:\t16}\ntextures: {\"a:\tb\": {file: a.png}}\nmaterials: {m: {diffuse: {color: {texture: \"a:\tb\"}}}}\n", Ok(16)),
        ("a tab as indent", "smithwalk: 1\nsampling:\n\tspp: 16\n", Err("not valid YAML")),
        ("JSON on a line", r#"{"smithwalk":1,"sampling":{"spp":16}}"#, Ok(16)),
        ("JSON with a trailing comma", r#"{"smithwalk": 1, "sampling": {"spp": 16,},}"#, Ok(16)),
        ("Windows", "smithwalk: 1\r\nsampling:\r\n  spp: 16\r\n", Ok(16)),
        ("old Macs", "smithwalk: 1\rsampling:\r  spp: 16\r", Ok(16)),
        ("no line end at the end", "smithwalk: 1\nsampling: {spp: 16}", Ok(16)),
        ("a byte order mark", "\u{feff}smithwalk: 1\nsampling: {spp: 16}\n", Ok(16)),
        ("a byte order mark before JSON", "\u{feff}{\"smithwalk\":\t1, \"sampling\":\t{\"spp\":\t16}}", Ok(16)),
        ("a start and an end", "%YAML 1.2\n---\nsmithwalk: 1\nsampling: {spp: 16}\n...\n", Ok(16)),
        ("comments everywhere", "# a\nsmithwalk: 1 # b\n# c\nsampling: # d\n  # e\n  spp: 16 # f\n", Ok(16)),
        ("an indent of one", "smithwalk: 1\nsampling:\n spp: 16\n", Ok(16)),
        ("a question mark", "smithwalk: 1\n? sampling\n: {spp: 16}\n", Ok(16)),
        ("a value on the next line", "smithwalk:\n  1\nsampling:\n  spp:\n    16\n", Ok(16)),
        ("quoted keys", "'smithwalk': 1\n\"sampling\": {'spp': 16}\n", Ok(16)),
        ("two documents", "smithwalk: 1\n---\nsmithwalk: 1\n", Err("expected one YAML document, found another")),
        ("no space behind a colon", "smithwalk:1\n", Err("s.yaml:1:1: expected a mapping, found the text `smithwalk:1`")),
        ("uneven indents", "smithwalk: 1\nsampling:\n  spp: 16\n seed: 1\n", Err("not valid YAML")),
        ("a brace that stays open", "smithwalk: 1\nsampling: {spp: 16\n", Err("not valid YAML")),
        ("a NUL", "smithwalk: 1\0\n", Err("s.yaml:1:")),
    ]);
}

#[test]
fn numbers() {
    let spp = |text: &str| format!("smithwalk: 1\nsampling: {{spp: {text}}}\n");
    let exposure = |text: &str| format!("smithwalk: 1\nsampling: {{spp: 16}}\nfilm: {{exposure: {text}}}\n");
    let texts = [
        ("decimal", spp("16"), Ok(16)),
        ("a plus", spp("+16"), Ok(16)),
        ("hexadecimal", spp("0x10"), Ok(16)),
        ("octal as of 1.2", spp("0o20"), Ok(16)),
        ("binary", spp("0b10000"), Ok(16)),
        ("octal as of 1.1", spp("020"), Err("found the text `020`")),
        ("grouped digits", spp("1_000"), Err("expected a whole number, 0 or more, found the text `1_000`")),
        ("commas between digits", spp("'1,000'"), Err("found the text `1,000`")),
        ("base 60", spp("1:00"), Err("s.yaml:2:")),
        ("a fraction", spp("16.5"), Err("expected a whole number, 0 or more, found the number 16.5")),
        ("a whole fraction", spp("16.0"), Err("expected a whole number, 0 or more, found the number 16.0")),
        ("an exponent for a count", spp("1e3"), Err("expected a whole number, 0 or more")),
        ("a negative count", spp("-16"), Err("expected a whole number, 0 or more, found the number -16")),
        ("more than 32 bits", spp("4294967296"), Err("s.yaml:2:")),
        ("more than 64 bits", spp("18446744073709551616"), Err("s.yaml:2:")),
        ("a number in quotes", spp("\"16\""), Err("found the text `16`")),
        ("nothing", spp(""), Err("expected a whole number, 0 or more, found nothing")),
        ("a tilde", spp("~"), Err("expected a whole number, 0 or more, found nothing")),
        ("a list", spp("[16]"), Err("expected a whole number, 0 or more, found a list of 1")),
        ("an expression", spp("2*8"), Err("found the text `2*8`")),
        ("an exponent", exposure("1e0"), Ok(16)),
        ("an exponent with signs", exposure("-1.5E+0"), Ok(16)),
        ("no digit before the point", exposure(".5"), Ok(16)),
        ("no digit behind the point", exposure("1."), Ok(16)),
        ("a whole number for a fraction", exposure("1"), Ok(16)),
        ("infinity", exposure(".inf"), Err("expected a finite number, found `.inf`")),
        ("minus infinity", exposure("-.Inf"), Err("expected a finite number, found `-.Inf`")),
        ("NaN", exposure(".NaN"), Err("expected a finite number, found `.NaN`")),
        ("Python's NaN", exposure("nan"), Err("expected a number, found the text `nan`")),
        ("Python's infinity", exposure("inf"), Err("expected a number, found the text `inf`")),
        ("JavaScript's infinity", exposure("Infinity"), Err("found the text `Infinity`")),
        ("beyond single precision", exposure("1e39"), Err("expected a finite number, found `1e39`")),
        ("a comma for the point", exposure("'0,5'"), Err("found the text `0,5`")),
        ("Fortran's exponent", exposure("1d0"), Err("found the text `1d0`")),
        ("a unit", exposure("1 EV"), Err("found the text `1 EV`")),
        ("a Unicode minus", exposure("\u{2212}1"), Err("found the text `\u{2212}1`")),
        ("a percentage", exposure("50%"), Err("found the text `50%`")),
    ];
    let cases: Vec<_> = texts.iter().map(|(what, text, becomes)| (*what, text.as_str(), *becomes)).collect();
    check(&cases);
}

#[test]
fn truths_names_and_references() {
    let seen = |text: &str| format!("smithwalk: 1\nsampling: {{spp: 16}}\nlights: [point: {{power: 1, visible_to_camera: {text}}}]\n");
    let with = |text: &str| format!("smithwalk: 1\nsampling: {{spp: 16}}\n{text}");
    let said = Err("expected true or false, found the text");
    let texts = [
        ("true", seen("true"), Ok(16)),
        ("True", seen("True"), Ok(16)),
        ("FALSE", seen("FALSE"), Ok(16)),
        ("yes", seen("yes"), said),
        ("no", seen("no"), said),
        ("on", seen("on"), said),
        ("a quoted truth", seen("'true'"), said),
        ("one", seen("1"), Err("expected true or false, found the number 1")),
        ("a key twice", with("film: {width: 8, width: 9}\n"), Err("the key `width` is given twice, first in line 3")),
        ("a section twice", with("film: {width: 8}\nfilm: {height: 8}\n"), Err("s.yaml:4:1: the key `film` is given twice")),
        ("a key twice in quotes", with("film: {width: 8, 'width': 9}\n"), Err("the key `width` is given twice")),
        ("a name twice", with("meshes:\n  a: {file: a.obj}\n  a: {file: b.obj}\n"), Err("the key `a` is given twice")),
        ("a merge key", with("film: &f {width: 8}\nworld: {<<: *f}\n"), Err("merge keys are not read")),
        ("an alias", with("meshes: {a: &a {file: a.obj}, b: *a}\n"), Ok(16)),
        ("an alias of a number", "smithwalk: &one 1\nsampling: {spp: *one}\n".to_owned(), Ok(1)),
        ("an anchor that nobody names", with("film: &f {width: 8}\n"), Ok(16)),
        ("an anchor given again", with("meshes: {a: &a {file: a.obj}, b: &a {file: b.obj}, c: *a}\n"), Ok(16)),
        ("an alias of nothing", with("film: *f\n"), Err("not valid YAML")),
        ("an alias of itself", with("film: &f {width: *f}\n"), Err("this alias names what it stands in")),
        ("a tag", with("film: !film {width: 8}\n"), Err("expected no YAML tag, found `!film`")),
        ("a tag of the core", with("film: {width: !!int 8}\n"), Err("expected no YAML tag, found `!!int`")),
        ("Python's tag", with("film: {width: !!python/object:os.system 8}\n"), Err("expected no YAML tag")),
        ("names that are numbers", with("meshes: {1: {file: a.obj}}\nmaterials: {2: {diffuse: {}}}\nobjects: [{mesh: '1', material: '2'}]\n"), Ok(16)),
        ("names with dots and blanks", with("meshes: {a.b c: {file: a.obj}}\nobjects: [{mesh: a.b c}]\n"), Ok(16)),
        ("names in other scripts", with("meshes: {立方体: {file: 立方体.obj}}\nobjects: [{mesh: 立方体}]\n"), Ok(16)),
        ("two spellings of one name", with("meshes: {\u{e9}: {file: a.obj}}\nobjects: [{mesh: e\u{301}}]\n"), Err("there is no mesh `e\u{301}`")),
        ("a list as key", with("[1, 2]: 3\n"), Err("expected a name as key, found a collection")),
        ("an empty key", with("'': 3\n"), Err("unknown key ``")),
        ("empty sections", with("textures:\n"), Ok(16)),
        ("a key with a terminal's commands", with("\"\\e[31m\": 3\n"), Err("unknown key `\\u{1b}[31m`")),
    ];
    let cases: Vec<_> = texts.iter().map(|(what, text, becomes)| (*what, text.as_str(), *becomes)).collect();
    check(&cases);
    let long = with(&format!("{}: 3\n", "x".repeat(100_000)));
    let name = with(&format!("objects: [{{mesh: {}}}]\n", "y".repeat(100_000)));
    let number = with(&format!("film: {{exposure: \"{}\"}}\n", "z".repeat(100_000)));
    check(&[("a long key", &long, Err("simple key expect")), ("a long name", &name, Err("yyy…`")), ("a long text", &number, Err("zzz…`"))]);
}
