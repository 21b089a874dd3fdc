//! Overlays: what of the computation is drawn over the picture.

use egui::Ui;
use nephroid::render::Overlay;

/// A box for each overlay.
pub fn overlays(ui: &mut Ui, shown: &mut Vec<Overlay>) {
    for overlay in Overlay::ALL {
        let mut is_shown = shown.contains(&overlay);
        if ui
            .checkbox(&mut is_shown, overlay.name())
            .on_hover_text(overlay.about())
            .changed()
        {
            set(shown, overlay, is_shown);
        }
    }
}

/// Shows or hides an overlay.
pub fn set(shown: &mut Vec<Overlay>, overlay: Overlay, is_shown: bool) {
    shown.retain(|other| *other != overlay);
    if is_shown {
        shown.push(overlay);
        shown.sort_by_key(|overlay| Overlay::ALL.iter().position(|other| other == overlay));
    }
}

/// Shows the overlay after the last one that is shown, or none.
pub fn next(shown: &mut Vec<Overlay>) {
    let after = match shown.last() {
        None => Overlay::ALL.first(),
        Some(last) => (Overlay::ALL.iter())
            .skip_while(|overlay| *overlay != last)
            .nth(1),
    };
    *shown = after.copied().into_iter().collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_overlays_come_one_after_the_other() {
        let mut shown = Vec::new();
        for overlay in Overlay::ALL {
            next(&mut shown);
            assert_eq!(shown, [overlay]);
        }
        next(&mut shown);
        assert!(shown.is_empty());
        for overlay in [Overlay::Cells, Overlay::Patches, Overlay::Cells] {
            set(&mut shown, overlay, true);
        }
        assert_eq!(shown, [Overlay::Patches, Overlay::Cells]);
        set(&mut shown, Overlay::Patches, false);
        assert_eq!(shown, [Overlay::Cells]);
    }
}
