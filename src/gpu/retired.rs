//! What a host's frames in flight may still use.

/// Objects that were replaced, until no frame in flight uses them.
pub struct Retired<T> {
    /// Maximum number of frames in flight.
    frames: u32,
    /// Each with the number of frames until none in flight uses it.
    objects: Vec<(u32, T)>,
}

impl<T> Retired<T> {
    /// Of at most `frames` frames in flight.
    pub fn new(frames: u32) -> Self {
        Self {
            frames: frames.max(1),
            objects: Vec::new(),
        }
    }

    /// Keeps an object that the last frame may use and the next one does not.
    pub fn keep(&mut self, object: T) {
        self.objects.push((self.frames, object));
    }

    /// Takes out what no frame in flight uses any more, before the next frame is recorded.
    pub fn begin_frame(&mut self) -> impl Iterator<Item = T> {
        (self.objects.iter_mut()).for_each(|(frames, _)| *frames -= 1);
        let unused = self.objects.extract_if(.., |(frames, _)| *frames == 0);
        unused.map(|(_, object)| object)
    }

    /// Drops all objects: no frame is in flight.
    pub fn clear(&mut self) {
        self.objects.clear();
    }

    /// The last frame is not submitted, and is none of those in flight.
    pub fn forget_last(&mut self) {
        (self.objects.iter_mut()).for_each(|(frames, _)| *frames += 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With two frames in flight, what the first frame used is unused when the third is recorded, unless one is not submitted.
    #[test]
    fn objects_outlive_the_frames_in_flight() {
        let mut retired = Retired::new(2);
        retired.keep('a');
        assert_eq!(retired.begin_frame().count(), 0);
        retired.forget_last();
        retired.keep('b');
        assert_eq!(retired.begin_frame().count(), 0);
        assert_eq!(retired.begin_frame().collect::<String>(), "ab");
        assert_eq!(retired.begin_frame().count(), 0);
    }
}
