# The commands of the README. They install what the system lacks (see .ci/setup).

.PHONY: demo view test fuzz drivers accuracy bench
.SILENT:

# A picture of a metal ring and its caustic.
demo:
	.ci/setup demo
	cargo build --release
	./target/release/nephroid render assets/scenes/ring.toml -o ring.png

# A window on the same scene: docs/viewer.md.
view:
	.ci/setup view
	cargo run --release --features viewer -- view assets/scenes/ring.toml

# All tests, under the validation layers. Three at a time: while one computes a reference, others wait for the device.
test:
	.ci/setup test
	cargo test --release --features dev -- --test-threads=3

# The same scenes and tests on lavapipe 25 and SwiftShader (docs/drivers.md): long.
drivers:
	.ci/setup test
	.ci/drivers fetch
	cargo build --release
	.ci/drivers check
	.ci/drivers test

# docs/accuracy.md, measured again: about a minute.
accuracy:
	.ci/setup demo
	cargo run --release --example accuracy

# What every pass costs, beside points of equal error, and what motion costs: a few minutes.
bench:
	.ci/setup demo
	cargo bench --bench passes --bench motion

# Mutated input for every reader of files, a minute each or FUZZ_SECONDS: docs/fuzzing.md.
fuzz:
	.ci/setup fuzz
	fuzz/run
