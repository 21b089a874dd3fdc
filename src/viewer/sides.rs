//! Has the display render the sides that the state asks for.

use super::display::Display;
use super::state::{Severity, State};
use nephroid::scene::Scene;
use nephroid::{Error, Result};

/// Makes the renderers of other techniques, and of B when the comparison begins; whether there is a new one. Where one cannot
/// be made, its technique stays as it was.
pub fn fit(display: &mut Display, state: &mut State) -> bool {
    let techniques = state.compare.sides().to_vec();
    if display.sides.len() > techniques.len() {
        end(display, state);
    }
    if let ([a, b], [of_a, of_b]) = (techniques.as_slice(), display.sides.as_mut_slice())
        && !a.same_renderer(&of_a.made_for)
        && a.same_renderer(&of_b.made_for)
        && b.same_renderer(&of_a.made_for)
    {
        std::mem::swap(of_a, of_b);
    }
    let mut is_new = false;
    for (index, technique) in techniques.iter().enumerate() {
        let made_for = display.sides.get(index).map(|side| side.made_for);
        if made_for.is_some_and(|made_for| technique.same_renderer(&made_for)) {
            continue;
        }
        let scene = state.scene();
        match (display.set_side(index, &scene, technique), made_for) {
            (Ok(()), _) => is_new = true,
            (Err(error), Some(made_for)) => {
                state.tell(Severity::Error, error.to_string());
                state.compare.techniques[index] = made_for;
            }
            (Err(error), None) => fail(display, state, &error),
        }
    }
    if is_new {
        tell_notes(display, state);
    }
    is_new
}

/// Makes all renderers for another scene; whether A can be rendered.
pub fn renew(display: &mut Display, state: &mut State, scene: &Scene) -> bool {
    let is_done = (0..display.sides.len()).all(|index| set(display, state, scene, index));
    tell_notes(display, state);
    is_done
}

/// Takes the scene over to the renderers; whether A can be rendered.
///
/// # Errors
/// [`Error::Device`] where the device fails.
pub fn update(display: &mut Display, state: &mut State, scene: &Scene) -> Result<bool> {
    for index in 0..display.sides.len() {
        if !display.sides[index].update(scene)? && !set(display, state, scene, index) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Makes a side's renderer again; whether A can be rendered. Where B cannot, the comparison ends.
fn set(display: &mut Display, state: &mut State, scene: &Scene, index: usize) -> bool {
    let technique = state.compare.sides()[index];
    match display.set_side(index, scene, &technique) {
        Ok(()) => true,
        Err(error) if index > 0 => {
            fail(display, state, &error);
            true
        }
        Err(error) => {
            state.tell(Severity::Error, error.to_string());
            false
        }
    }
}

/// Says what light B leaves out and A does not.
fn tell_notes(display: &Display, state: &mut State) {
    if let [a, b] = display.sides.as_slice()
        && !b.made_for.is_reference
    {
        let of_a = a.notes();
        for note in b.notes().iter().filter(|note| !of_a.contains(note)) {
            state.tell(Severity::Note, format!("B: {note}"));
        }
    }
}

/// Shows A only, since B cannot be rendered.
fn fail(display: &mut Display, state: &mut State, error: &Error) {
    let text = format!("B cannot be rendered, and the comparison has ended: {error}");
    state.tell(Severity::Error, text);
    state.compare.is_on = false;
    end(display, state);
}

fn end(display: &mut Display, state: &mut State) {
    display.end_comparison();
    state.compare.differences.clear();
}
