//! Files that are no scene, and scenes beyond measure.

use super::harness::{SOLID, Wrong, changed, refused};

#[test]
fn files_that_are_no_scene() {
    let scene = |name: &str, text: &[u8]| Wrong::scene(name, text);
    refused([
        Wrong::calls("no file", &["check none.toml", "run none.toml"])
            .at("none.toml")
            .says(&["the scene cannot be read: No such file", "a TOML file is needed"]),
        Wrong::calls("a directory", &["check scenes", "run scenes"])
            .file("scenes/a.txt", "")
            .at("scenes")
            .says(&["the scene cannot be read: Is a directory", "a TOML file is needed"]),
        scene("an empty file", b"")
            .at("scene.toml")
            .says(&["the key \"name\" is missing"]),
        scene("spaces only", b"\n\n  \n")
            .at("scene.toml")
            .says(&["the key \"name\" is missing"]),
        scene("not UTF-8", b"name = 'b\xff\xfe'\n")
            .at("scene.toml:1")
            .says(&["not UTF-8", "a TOML file is needed"]),
        scene("UTF-16", b"\xff\xfen\0a\0m\0e\0")
            .at("scene.toml:1")
            .says(&["not UTF-8", "a TOML file is needed"]),
        scene(
            "a mesh in place of a scene",
            &super::harness::sample("vtk_binary_none_32_le.vtu"),
        )
        .at("scene.toml:1")
        .says(&["expected"]),
        scene("zeros", &[0; 4096]).at("scene.toml:1").says(&["expected"]),
        scene("bytes", &(0..5000u32).map(|i| (i * i % 127) as u8).collect::<Vec<_>>())
            .at("scene.toml:1")
            .says(&["expected"]),
        scene("an escape sequence", b"name = 'a'\n\x1b[31mred = 1\n")
            .at("scene.toml:2")
            .says(&["expected"]),
        scene("JSON", b"{ \"name\": \"beam\" }\n")
            .at("scene.toml:1")
            .says(&["expected"]),
    ]);
}

#[test]
fn scenes_nested_too_deeply() {
    let n = 100_000;
    let scene = |name: &str, text: String| Wrong::scene(name, text);
    refused([
        scene("lists in lists", format!("name = {}{}", "[".repeat(n), "]".repeat(n)))
            .at("scene.toml:1: name")
            .says(&["it is nested too deeply; at most 80 levels are accepted"]),
        scene("lists that do not end", format!("name = {}", "[".repeat(n)))
            .at("scene.toml:1: name")
            .says(&["it is nested too deeply; at most 80 levels are accepted"]),
        scene(
            "tables in tables",
            format!("name = {}{}", "{ a = ".repeat(n), "}".repeat(n)),
        )
        .at(&format!("scene.toml:1: name{}", ".a".repeat(80)))
        .says(&["it is nested too deeply; at most 80 levels are accepted"]),
        scene("a key of very many parts", format!("name{} = 1", ".a".repeat(n)))
            .at("scene.toml")
            .says(&["it is nested too deeply; at most 80 levels are accepted"]),
        scene("a section of very many parts", format!("[name{}]", ".a".repeat(n)))
            .at("scene.toml")
            .says(&["it is nested too deeply; at most 80 levels are accepted"]),
    ]);
}

#[test]
fn scenes_of_ten_megabytes() {
    let long = "a".repeat(10_000_000);
    let many = |section: &str, n: usize| (0..n).map(|i| section.replace('#', &i.to_string())).collect::<String>();
    let comments = "# nothing but words, words, words\n".repeat(300_000);
    let probes = many("[[probe]]\nname = 'p#'\npoint = [1, 0, 0]\n", 220_000);
    let quantities = many("[[quantity]]\nname = 'q#'\nenergy = true\n", 220_000);
    let last = 19 + 3 * 220_000;
    refused([
        Wrong::scene(
            "a mistake after ten megabytes",
            format!("{comments}{}", changed(SOLID, "dt = 0.01", "dt = 0")),
        )
        .at("scene.toml:300014: time.dt")
        .says(&["0.0 is not accepted"]),
        Wrong::scene(
            "a name of ten megabytes",
            changed(SOLID, "'beam'", &format!("'{long}'")),
        )
        .at("scene.toml:1: name")
        .says(&["is not accepted; it names files"]),
        Wrong::scene(
            "a key of ten megabytes",
            changed(SOLID, "dt = 0.01", &format!("dt = 0.01\n{long} = 1")),
        )
        .at(&format!("scene.toml:15: time.{}...", &long[..60]))
        .says(&["unknown key \"aaaa", "accepted: \"scheme\", \"dt\""]),
        Wrong::scene(
            "a choice of ten megabytes",
            changed(SOLID, "'backward-euler'", &format!("'{long}'")),
        )
        .at("scene.toml:13: time.scheme")
        .says(&["unknown value \"aaaa", "accepted: \"static\""]),
        Wrong::scene(
            "axes of ten megabytes",
            changed(
                SOLID,
                "where = 'x < 1e-9'",
                &format!("where = 'x < 1e-9'\naxes = '{long}'"),
            ),
        )
        .at("scene.toml:10: fixed.axes")
        .says(&["letters x, y, z, each at most once"]),
        Wrong::scene(
            "an unknown name of ten megabytes",
            changed(SOLID, "where = 'x < 1e-9'", &format!("where = '{long} < 1'")),
        )
        .at("scene.toml:9: fixed.where")
        .says(&["at most 65536 are accepted"]),
        Wrong::scene(
            "very many vertices, the last of which does not exist",
            changed(
                SOLID,
                "where = 'x < 1e-9'",
                &format!("vertices = [{}99]", "0,".repeat(5_000_000)),
            ),
        )
        .at("scene.toml:9: fixed.vertices")
        .says(&["vertex 99 does not exist"]),
        Wrong::scene(
            "very many probes, the last of one name",
            format!(
                "{}{probes}[[probe]]\nname = 'p7'\npoint = [1, 0, 0]\n",
                SOLID.split("[[probe]]").next().unwrap()
            ),
        )
        .at(&format!("scene.toml:{}: probe[220000].name", last + 1))
        .says(&["\"p7\" is not accepted; a name of its own"]),
        Wrong::scene(
            "very many quantities, the last of one name",
            format!(
                "{}{quantities}[[quantity]]\nname = 'q7'\nenergy = true\n",
                SOLID.split("[[probe]]").next().unwrap()
            ),
        )
        .at(&format!("scene.toml:{}: quantity[220000].name", last + 1))
        .says(&["\"q7\" is not accepted; a name of its own"]),
    ]);
}
