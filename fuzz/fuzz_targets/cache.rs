#![no_main]

use libfuzzer_sys::fuzz_target;
use nephroid_fuzz::Inputs;
use std::sync::LazyLock;

static INPUTS: LazyLock<Inputs> = LazyLock::new(Inputs::new);

fuzz_target!(|input: &[u8]| INPUTS.cache(input));
