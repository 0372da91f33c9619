//! Prints the hash of every shipped scene, as this machine's own build of the engine has it. The test in a browser
//! holds the hashes of the WebAssembly module against these.

use serde_json::{Value, json};

fn ask(request: &Value) -> Value {
    hpu_web::answer(&request.to_string()).expect("shipped scenes run").json
}

fn main() {
    for scene in ask(&json!({ "do": "scenes" }))["scenes"].as_array().expect("scenes") {
        let hash = ask(&json!({ "do": "hash", "scene": scene["name"] }));
        println!("{} {}", scene["name"].as_str().expect("a name"), hash["hash"].as_str().expect("a hash"));
    }
}
